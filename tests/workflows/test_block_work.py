"""Textures encoded on a Dask cluster of real processes: as here, whatever happens to workers."""

from __future__ import annotations

import dataclasses
import os
import pickle
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import Btf, TableBtf
from nacre.errors import NacreError
from nacre.runtime.progress import silent
from nacre.workflows import Cluster, encode_texture
from nacre.workflows.block_work import Block, Blocks, BlockWorkers, Failure
from nacre.workflows.encoded_blocks import BlockEncoder
from nacre.workflows.encoding import encode
from nacre.workflows.identity import source_fingerprint
from nacre.workflows.openers import PickledTexture, TextureFile, pickled
from nacre.workflows.submission import EndedError
from nacre.workflows.worker import Here, Unread
from tests.textures.codecs.basis.made import codec
from tests.textures.support import ByImage
from tests.workflows.processes import Scheduler, scheduler
from tests.workflows.support import eventually
from tests.workflows.test_encoding import COARSE, MADE, texture

HERE = Here("tcp://worker:1", "", silent)
ENCODER = BlockEncoder(codec(), *COARSE, np.dtype(np.float32), 50, "felt")


class Computed(Btf):
    """A texture of 20 x 7 texels that are computed when they are asked for.

    The first process that reads a block that starts at one of `held` writes its number into a file
    in `folder`, and waits until a file named "go" is there.
    """

    def __init__(self, folder: Path = Path(), held: tuple[int, ...] = ()) -> None:
        super().__init__(20, 7, *COARSE, name="felt")
        self.folder, self.held = folder, held

    def texels(self, chosen):
        name = self.folder / f"{chosen.start}.worker"
        if chosen.start in self.held and not name.exists():
            name.write_text(str(os.getpid()))
            eventually((self.folder / "go").exists)
        return codec().decoder(*COARSE)(MADE.reshape(-1, 2)[chosen])

    def images(self, chosen):
        raise AssertionError("is read by texel")

    def worker(self, start: int) -> int:
        """The process that waits at a block, as soon as it does."""
        name = self.folder / f"{start}.worker"
        process = int(eventually(lambda: name.exists() and name.read_text()))
        assert process != os.getpid()
        return process

    def go(self) -> None:
        """Let all go on."""
        (self.folder / "go").touch()


class Broken(TableBtf):
    """Cannot be read beyond a texel."""

    def texels(self, chosen):
        if chosen.stop > 100:
            raise nacre.FormatError("felt.npz: values: some are not finite; write the file again")
        return super().texels(chosen)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Scheduler:
    pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    with scheduler(tmp_path_factory.mktemp("cluster")) as running, running.workers(2):
        yield running


@pytest.fixture
def source(tmp_path: Path) -> Path:
    nacre.save(texture(), tmp_path / "felt.npz")
    return tmp_path / "felt.npz"


def file(path: Path) -> TextureFile:
    return TextureFile(path, None, None, source_fingerprint(path))


def equal(found, expected) -> None:
    np.testing.assert_array_equal(found.codes, expected.codes)
    assert found.errors == expected.errors


def in_worker(work: Blocks, job: Block, *, send: bool = False):
    """What a worker returns, which gets the work as bytes."""
    item, content = work.pack(job, send=send)
    return pickle.loads(pickle.dumps(work)).do(item, content, HERE)


def test_a_block_is_the_same_by_path_by_content_and_computed(source):
    made = nacre.load(source)
    job = Block(slice(40, 60), lambda: made.texels(slice(40, 60)))
    expected = ENCODER(40, made.texels(slice(40, 60)))
    for opener, send in ((file(source), False), (file(source), True), (None, False)):
        found = in_worker(Blocks(ENCODER, opener), job, send=send)
        np.testing.assert_array_equal(found.codes, expected.codes)
        np.testing.assert_array_equal(found.sums, expected.sums)
    computed = Computed()
    item, content = Blocks(ENCODER, PickledTexture(computed)).pack(job, send=False)
    assert (item, content) == ((40, 60), None)
    found = in_worker(Blocks(ENCODER, pickled(computed)), job)
    expected = ENCODER(40, computed.texels(slice(40, 60)))
    np.testing.assert_array_equal(found.codes, expected.codes)


def test_a_worker_without_the_file_says_so(source, tmp_path):
    job = Block(slice(0, 20), lambda: None)
    work = Blocks(ENCODER, file(source))
    os.utime(source, (1, 1))
    assert in_worker(work, job) == Unread(
        f"on worker tcp://worker:1: {source}: has another size or time of change than the owner's"
    )
    source.unlink()
    found = in_worker(work, job)
    assert isinstance(found, Unread)
    assert f"{source}: no such file" in found.reason


def test_what_is_wrong_with_a_block_is_its_result():
    work = Blocks(ENCODER, None)
    for values, words in (
        (np.full((2, len(COARSE[0]), 3), np.nan, np.float32), "felt: some texels have codes that"),
        (np.zeros((2, 1, 3), np.float32), "felt: on worker tcp://worker:1: ValueError: "),
    ):
        found = in_worker(work, Block(slice(0, 2), lambda values=values: values))
        assert isinstance(found, Failure)
        assert found.error.startswith(words)
    with pytest.raises(EndedError, match=r"felt: texels 0 to 1: killed .*; finished .* --resume"):
        work.failed(Block(slice(0, 2), lambda: None), EndedError("killed its worker 4 times"))


def test_only_small_textures_are_sent_whole():
    large = TableBtf(np.zeros((2, 2, 1 << 17, 3), np.float16), *np.zeros((2, 1 << 17, 3)))
    assert pickled(large) is None
    computed = Computed()
    computed_with_a_lock = Computed()
    vars(computed_with_a_lock)["lock"] = threading.Lock()
    assert pickled(computed_with_a_lock) is None
    assert pickled(computed) is not None


def test_pictures_have_no_path_for_workers():
    workers = BlockWorkers(Cluster("tcp://127.0.0.1:1", data="path"))
    made = ByImage(texture())
    vars(made)["lock"] = threading.Lock()
    with pytest.raises(NacreError, match=r"felt: workers cannot read .* leave out --data path"):
        encode(made, codec(), workers=workers)


@pytest.mark.slow
@pytest.mark.parametrize("data", ["path", "content", "auto"])
def test_a_cluster_writes_the_same_file(cluster, source, tmp_path, data):
    encode_texture(source, tmp_path / "here.safetensors", texels_per_block=9)
    seen: list[int] = []
    encode_texture(
        source,
        tmp_path / "there.safetensors",
        texels_per_block=9,
        cluster=Cluster(cluster.address, data=data),
        progress=lambda stage, done, total, note: seen.append(done),
    )
    here = (tmp_path / "here.safetensors").read_bytes()
    assert (tmp_path / "there.safetensors").read_bytes() == here
    assert seen == sorted(seen)
    assert seen[-1] == 140
    assert len(seen) == 16
    assert not list(tmp_path.glob("*.state"))


@pytest.mark.slow
def test_killed_workers_cost_their_blocks_only(cluster, tmp_path):
    held = (0, 60, 120)
    made = Computed(tmp_path, held)
    expected = encode(Computed(), codec(), texels_per_block=5)
    killed: list[int] = []

    def kill() -> None:
        for start in held:
            killed.append(made.worker(start))
            os.kill(killed[-1], signal.SIGKILL)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    seen: list[int] = []
    found = encode(
        made,
        codec(),
        texels_per_block=5,
        workers=BlockWorkers(Cluster(cluster.address)),
        progress=lambda stage, done, total, note: seen.append(done),
    )
    killer.join()
    assert len(set(killed)) == 3
    assert seen == list(range(5, 141, 5))
    equal(found, expected)


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done_and_any_place_resumes(cluster, tmp_path):
    made, state = texture(), tmp_path / "state"
    expected = encode(made, codec(), texels_per_block=5)

    def stop(stage, done, total, note):
        if done >= 30:
            raise KeyboardInterrupt

    workers = BlockWorkers(Cluster(cluster.address))
    common = {"texels_per_block": 5, "state": state}
    with pytest.raises(KeyboardInterrupt):
        encode(made, codec(), workers=workers, progress=stop, **common)
    began: list[int] = []
    stopped = state.read_bytes()
    for again in (None, workers):
        state.write_bytes(stopped)
        found = encode(
            made,
            codec(),
            workers=again,
            progress=lambda stage, done, total, note: began.append(done),
            **common,
        )
        assert began[0] == 35
        began.clear()
        equal(found, expected)


@pytest.mark.slow
def test_errors_and_other_workers_are_one_line(cluster, monkeypatch):
    workers = BlockWorkers(Cluster(cluster.address))
    broken = Broken(texture().values, *COARSE, "felt")
    with pytest.raises(NacreError, match=r"felt\.npz: values: some are not finite"):
        encode(broken, codec(), texels_per_block=10, workers=workers)
    other = dataclasses.replace(workers, opener=PickledTexture(broken))
    with pytest.raises(NacreError, match=r"felt\.npz: values: some are not finite"):
        encode(broken, codec(), texels_per_block=10, workers=other)
    monkeypatch.setattr(Blocks, "code", lambda self: "other")
    with pytest.raises(NacreError, match=r"worker tcp://.* with other code than the run's"):
        encode(texture(), codec(), workers=workers)


@pytest.mark.slow
def test_a_scheduler_that_dies_leaves_a_state(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    made, state = Computed(tmp_path, (100,)), tmp_path / "state"
    (tmp_path / "cluster").mkdir()
    with scheduler(tmp_path / "cluster") as running, running.workers(1):

        def kill() -> None:
            made.worker(100)
            running.process.send_signal(signal.SIGKILL)

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        begun = time.monotonic()
        with pytest.raises(EndedError, match="finished blocks are kept, add --resume") as caught:
            encode(
                made,
                codec(),
                texels_per_block=5,
                state=state,
                workers=BlockWorkers(Cluster(running.address)),
            )
        assert "\n" not in str(caught.value)
        assert time.monotonic() - begun < 60
        killer.join()
    began: list[int] = []
    found = encode(
        made := Computed(),
        codec(),
        texels_per_block=5,
        state=state,
        progress=lambda stage, done, total, note: began.append(done),
    )
    assert began[0] > 50
    equal(found, encode(made, codec(), texels_per_block=5))
