"""Textures encoded in blocks, stopped and gone on with, and compared with others."""

from __future__ import annotations

import itertools
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.measured.textures import BONN, UTIA, transposed
from nacre.measured.textures.domes import below, pairs
from nacre.metrics.texture_comparison import compare_textures
from nacre.metrics.texture_errors import ErrorSums
from nacre.textures import LatentMap, NeuralBtf
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.workflows import encoded_blocks
from nacre.workflows import encoding as module
from nacre.workflows.encoding import encode
from tests.textures.codecs.basis.made import codec
from tests.textures.support import ByImage
from tests.workflows.support import eventually

COARSE = pairs(*[BONN.directions[below(BONN.directions, 70.0)][::5]] * 2)
MADE = np.random.default_rng(8).normal(size=(7, 20, 2)).astype(np.float32)


def texture() -> TableBtf:
    """What a codec makes of some codes, with noise."""
    values = codec().decoder(*COARSE)(MADE.reshape(-1, 2))
    noise = np.random.default_rng(9).normal(size=values.shape).astype(np.float32)
    return TableBtf((values + 0.05 * noise).reshape(7, 20, -1, 3), *COARSE, "felt")


def test_codes_are_those_of_the_codec_whatever_the_blocks():
    made = texture()
    expected = codec().encoder(*COARSE)(made.texels(slice(None)))
    for texels_per_block in (None, 1000, 140, 33, 1):
        found = encode(made, codec(), texels_per_block=texels_per_block)
        assert found.codes.shape == (7, 20, 2)
        np.testing.assert_allclose(found.codes.reshape(-1, 2), expected, atol=1e-2)


def test_the_error_is_that_of_what_is_written():
    made = texture()
    found = encode(made, codec(), half=True)
    assert found.codes.dtype == np.float16
    assert found.compared == made.pair_count
    decoded = codec().decoder(*COARSE)(found.codes.reshape(-1, 2).astype(np.float32))
    difference = decoded.astype(float) - made.texels(slice(None))
    assert found.errors.count == difference.size
    assert found.errors.mse == pytest.approx(np.mean(difference**2), rel=1e-5)
    assert found.errors.mae == pytest.approx(np.mean(np.abs(difference)), rel=1e-5)
    truth = np.mean(made.texels(slice(None)).astype(float) ** 2)
    assert found.errors.relative == pytest.approx(np.sqrt(np.mean(difference**2) / truth), rel=1e-5)
    assert found.errors.psnr == pytest.approx(-10 * np.log10(np.mean(difference**2)), rel=1e-5)
    polar = np.degrees(np.arccos(COARSE[1][:, 2]))
    for low, high, mse in found.errors.by_elevation:
        ring = (polar > low - 0.05) & (polar < high - 0.05)
        assert mse == pytest.approx(np.mean(difference[:, ring] ** 2), rel=1e-5)
    assert [low for low, _, _ in found.errors.by_elevation] == [0, 15, 30, 45, 60]


def test_a_sample_of_pairs_tells_about_the_same_error(monkeypatch):
    monkeypatch.setattr("nacre.workflows.encoding._COMPARED", 140 * 40)
    whole = compare_textures(texture(), decoded(encode(texture(), codec()).codes))
    found = encode(texture(), codec(), texels_per_block=20)
    assert found.compared == 40
    assert found.errors.count == 140 * 40 * 3
    assert found.errors.mse == pytest.approx(whole.errors.mse, rel=0.1)


def decoded(codes, directions=COARSE) -> NeuralBtf:
    return NeuralBtf(LatentMap(codes, codec(), *directions))


class Stopping(TableBtf):
    """Is interrupted once some texels are read."""

    def texels(self, chosen):
        if isinstance(chosen, slice) and chosen.start >= 60:
            raise KeyboardInterrupt
        return super().texels(chosen)


def test_what_was_interrupted_goes_on(tmp_path):
    made, state = texture(), tmp_path / "state"
    whole = encode(made, codec(), texels_per_block=20)
    with pytest.raises(KeyboardInterrupt):
        encode(Stopping(made.values, *COARSE), codec(), texels_per_block=20, state=state)
    read: list[int] = []

    class Noting(TableBtf):
        def texels(self, chosen):
            read.append(chosen.start)
            return super().texels(chosen)

    with pytest.raises(NacreError, match="belongs to another run; remove it"):
        encode(made, codec(), texels_per_block=20, state=state, fingerprint="other")
    with pytest.raises(NacreError, match="belongs to another run"):
        encode(made, codec(), texels_per_block=20, state=state, half=True)
    found = encode(Noting(made.values, *COARSE), codec(), texels_per_block=20, state=state)
    assert read == [60, 80, 100, 120]
    np.testing.assert_array_equal(found.codes, whole.codes)
    assert found.errors == whole.errors
    for damage in (b"", b"x" * 50, b'{"other": 1}'):
        state.write_bytes(damage)
        with pytest.raises(NacreError, match="cannot be read, remove it"):
            encode(made, codec(), texels_per_block=20, state=state)


def test_damage_to_a_state_costs_the_blocks_that_it_hits(tmp_path):
    made, state = texture(), tmp_path / "state"
    whole = encode(made, codec(), texels_per_block=20)
    with pytest.raises(KeyboardInterrupt):
        encode(Stopping(made.values, *COARSE), codec(), texels_per_block=20, state=state)
    kept = state.read_bytes()
    record = (len(kept) - kept.index(b"\n") - 1) // 3
    for damaged in (
        kept[:-1],  # a block that was being written
        kept[: -record + 1],
        kept[:-record],
        kept[:-1] + bytes([kept[-1] ^ 1]),
        kept[: -2 * record - 1] + bytes([kept[-2 * record - 1] ^ 1]) + kept[-2 * record :],
    ):
        state.write_bytes(damaged)
        done: list[int] = []
        found = encode(
            made,
            codec(),
            texels_per_block=20,
            state=state,
            progress=lambda stage, count, total, note, done=done: done.append(count),
        )
        assert done == [60, 80, 100, 120, 140]  # one block more than were missing
        np.testing.assert_array_equal(found.codes, whole.codes)
        assert found.errors == whole.errors


def test_codes_that_are_no_numbers_are_an_error():
    class Broken(BasisCodec):
        def coder(self, wi, wo):
            encode = lambda texels: np.full((len(texels), 2), 1e6, np.float32)  # noqa: E731
            return super().coder(wi, wo)._replace(encode=encode)

    made = codec()
    broken = Broken(made.functions, made.complete, made.encode, made.decode, made.prior)
    with pytest.raises(NacreError, match="felt: some texels have codes that are not finite"):
        encode(texture(), broken, half=True)


def test_a_state_gets_what_is_new_only(tmp_path, monkeypatch):
    """The first bytes stay as they are, and each block adds as many as the one before."""
    monkeypatch.setattr(encoded_blocks, "SAVE_EVERY", -1.0)
    state, seen = tmp_path / "state", []
    encode(
        texture(),
        codec(),
        texels_per_block=20,
        state=state,
        progress=lambda *_: seen.append(state.read_bytes()),
    )
    assert len(seen) == 7
    assert len({len(after) - len(before) for before, after in itertools.pairwise(seen)}) == 1
    assert all(after.startswith(before) for before, after in itertools.pairwise(seen))


KILLED = """
import sys, time
from pathlib import Path
from nacre.btf import TableBtf
from nacre.workflows import encoded_blocks
from nacre.workflows.encoding import encode
from tests.textures.codecs.basis.made import codec
from tests.workflows.test_encoding import COARSE, texture

class Slow(TableBtf):
    def texels(self, chosen):
        time.sleep(float(sys.argv[3]))
        return super().texels(chosen)

encoded_blocks.SAVE_EVERY = float(sys.argv[2])
made = Slow(texture().values, *COARSE)
encode(made, codec(), texels_per_block=2, state=Path(sys.argv[1]))
"""


@contextmanager
def killed(state: Path, save_every: float, pause: float) -> Iterator[subprocess.Popen[bytes]]:
    """A process that encodes the texture, and is killed at the end of the block."""
    path = os.pathsep.join(filter(None, [*sys.path]))
    arguments = [sys.executable, "-c", KILLED, state, save_every, pause]
    process = subprocess.Popen([*map(str, arguments)], env={**os.environ, "PYTHONPATH": path})
    try:
        yield process
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()


def grown(state: Path, size: int) -> bool:
    return state.exists() and state.stat().st_size > size


@pytest.mark.skipif(sys.platform == "win32", reason="kills a process as Unix does")
def test_a_killed_process_loses_what_was_not_saved_only(tmp_path):
    state = tmp_path / "state"
    with killed(state, 0.2, 0.1) as process:
        eventually(lambda: grown(state, 1000) or process.poll() is not None)
    assert state.exists()
    began: list[int] = []
    found = encode(
        texture(),
        codec(),
        texels_per_block=2,
        state=state,
        progress=lambda stage, done, total, note: began.append(done),
    )
    assert began[0] > 2
    whole = encode(texture(), codec(), texels_per_block=2)
    np.testing.assert_array_equal(found.codes, whole.codes)
    assert found.errors == whole.errors


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills a process as Unix does")
def test_processes_killed_at_any_moment_leave_what_can_be_gone_on_with(tmp_path):
    state, dice, sizes = tmp_path / "state", random.Random(4), [0]
    for _ in range(8):
        with killed(state, -1.0, 0.002) as process:
            eventually(lambda: grown(state, sizes[-1]) or process.poll() is not None)
            time.sleep(dice.uniform(0.0, 0.05))
        sizes.append(state.stat().st_size)
    assert sizes == sorted(sizes)
    began: list[int] = []
    found = encode(
        texture(),
        codec(),
        texels_per_block=2,
        state=state,
        progress=lambda stage, done, total, note: began.append(done),
    )
    assert not began or began[0] > 8
    whole = encode(texture(), codec(), texels_per_block=2)
    np.testing.assert_array_equal(found.codes, whole.codes)
    assert found.errors == whole.errors


def test_textures_are_compared_at_the_same_pairs():
    made = texture()
    codes = encode(made, codec()).codes
    found = compare_textures(made, decoded(codes))
    values = codec().decoder(*COARSE)(codes.reshape(-1, 2))
    squares = np.square(values.astype(float) - made.texels(slice(None)))
    assert found.compared == made.pair_count
    assert found.errors.mse == pytest.approx(squares.mean(), rel=1e-5)
    np.testing.assert_allclose(found.texels.reshape(-1), squares.mean((1, 2)), rtol=1e-4)
    x, y, mse = found.worst()[0]
    assert y * 20 + x == squares.mean((1, 2)).argmax()
    assert mse == pytest.approx(squares.mean((1, 2)).max(), rel=1e-4)
    elsewhere = compare_textures(made, decoded(codes, UTIA.pairs()))
    assert elsewhere.errors.mse == pytest.approx(found.errors.mse, rel=1e-5)
    some = compare_textures(made, decoded(codes), pairs=100)
    assert some.compared == 100
    assert some.errors.count == 3 * 100 * 140
    table = TableBtf(values.reshape(7, 20, -1, 3), *COARSE)
    again = compare_textures(made, table, pairs=100)
    assert again.errors.mse == pytest.approx(some.errors.mse, rel=1e-5)


def test_textures_that_do_not_fit_are_refused():
    made = texture()
    with pytest.raises(NacreError, match="20 x 7 and 20 x 6 texels"):
        compare_textures(made, TableBtf(made.values[:6], *COARSE))
    turned = TableBtf(made.values, *(w[::-1] for w in COARSE))
    with pytest.raises(NacreError, match="not the same ones; give an encoded texture second"):
        compare_textures(made, turned)


def test_equal_and_black_textures_have_figures():
    black = np.zeros((2, 4, 3), np.float32)
    sums = ErrorSums()
    sums.add(black, black, UTIA.directions[:4])
    found = sums.result()
    assert (found.mse, found.mae, found.psnr) == (0.0, 0.0, np.inf)
    assert np.isnan(found.relative)
    assert found.facts()["PSNR"] is None
    assert found.facts()["relative RMSE"] is None


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("chosen", [slice(None), np.array([0, 3, 4, 11])])
def test_errors_are_those_of_double_precision(dtype, chosen):
    random = np.random.default_rng(0)
    truth = random.random((130, 12, 3)).astype(dtype)  # more than a core takes at a time
    wo = UTIA.directions[:12][chosen]
    other = random.random((130, len(wo), 3), np.float32)
    sums = ErrorSums()
    texels = sums.add(truth, other, wo, chosen)
    difference = other - truth[:, chosen].astype(np.float64)
    np.testing.assert_allclose(texels, np.square(difference).mean((1, 2)), rtol=1e-6)
    count, squares, absolute, truths = sums.sums.sum(0)
    assert count == difference.size
    np.testing.assert_allclose(squares, np.square(difference).sum(), rtol=1e-6)
    np.testing.assert_allclose(absolute, np.abs(difference).sum(), rtol=1e-6)
    np.testing.assert_allclose(truths, np.square(truth[:, chosen].astype(float)).sum(), rtol=1e-6)


def test_a_picture_folder_is_encoded_by_texel(tmp_path):
    made = texture()
    with transposed(ByImage(made), tmp_path, np.float32) as source:
        found = encode(source, codec())
    np.testing.assert_array_equal(found.codes, encode(made, codec()).codes)


def test_a_source_that_is_removed_meanwhile_does_not_spoil_the_report(tmp_path, monkeypatch):
    source = tmp_path / "felt.npz"
    nacre.save(texture(), source)
    size, save = source.stat().st_size, module.save_latent_map

    def late(latent, path):
        source.unlink()
        save(latent, path)

    monkeypatch.setattr(module, "save_latent_map", late)
    found = module.encode_texture(source, tmp_path / "codes.safetensors")
    assert found.source_nbytes == size
    assert (tmp_path / "codes.safetensors").exists()


def test_sums_of_another_kind_are_refused():
    good = ErrorSums().sums
    for sums in (good[:2], good.astype(np.float32)):
        with pytest.raises(ValueError, match="expected float64"):
            ErrorSums(sums)
