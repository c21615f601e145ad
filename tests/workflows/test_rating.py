"""Codes at a rate, tile by tile: stopped, killed, resumed, on any number of threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.runtime.journal import Journal
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store
from nacre.textures import LatentMap, load_latent_map, save_latent_map
from nacre.textures.limit import Rate
from nacre.workflows.rating import Recoding, recoded
from tests.textures.rates.made import latent


@pytest.fixture(autouse=True)
def small_tiles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nacre.textures.limit.TILE", 16)


def texture() -> LatentMap:
    """20 tiles of 16 x 16 texels: more than the search for a step looks at."""
    return latent(60, 70)


def bytes_of(found: Recoding, folder: Path) -> bytes:
    save_latent_map(found.latent, folder / "x.safetensors")
    return (folder / "x.safetensors").read_bytes()


def stopping(after: int) -> Progress:
    left = [after]

    def progress(*_: Any) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize(
    "rate", [Rate(3.0), pytest.param(Rate(quality=35.0), marks=pytest.mark.slow)]
)
def test_a_stopped_recoding_goes_on_to_the_same_bytes(rate: Rate, tmp_path: Path) -> None:
    reports: list[str] = []
    whole = bytes_of(recoded(texture(), rate, lambda *report: reports.append(report[0])), tmp_path)
    assert {"rate", "comparing"} <= set(reports)
    store, stops = Store(tmp_path / "x.state"), 0
    while True:
        try:
            with Journal(store) as journal:
                found = recoded(texture(), rate, stopping(30), journal)
            break
        except KeyboardInterrupt:
            stops += 1
            assert store.files()
            assert stops < 50
    assert stops >= 2
    assert bytes_of(found, tmp_path) == whole


def test_what_was_done_is_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store, rate = Store(tmp_path / "x.state"), Rate(3.0)
    with Journal(store, seconds=-1.0) as journal:
        whole = bytes_of(recoded(texture(), rate, silent, journal), tmp_path)

    def written(_: Any) -> list[bytes]:
        raise AssertionError("a tile was written again")

    monkeypatch.setattr("nacre.textures.rates.tiled.encode_bands", written)
    with Journal(store) as journal:
        assert bytes_of(recoded(texture(), rate, silent, journal), tmp_path) == whole


def test_bytes_do_not_depend_on_the_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for cores in (1, 3):
        monkeypatch.setattr("nacre.runtime.parallel.core_count", lambda cores=cores: cores)
        found.append(bytes_of(recoded(texture(), Rate(3.0)), tmp_path))
    assert found[0] == found[1]


def test_parts_of_a_file_are_decoded_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bytes_of(recoded(texture(), Rate(3.0)), tmp_path)
    whole = load_latent_map(tmp_path / "x.safetensors").codes.reshape(60 * 70, -1)
    read: list[int] = []
    rated = load_latent_map(tmp_path / "x.safetensors")
    assert rated.rated is not None
    decode: Callable[[int], Any] = rated.rated.tile_codes

    def noted(index: int) -> Any:
        read.append(index)
        return decode(index)

    object.__setattr__(rated.rated, "tile_codes", noted)
    assert rated.shape == (60, 70, 6)
    for chosen in (np.array([0, 17, 70 * 59 + 69]), slice(70 * 14, 70 * 17), slice(-5, None)):
        np.testing.assert_array_equal(rated.codes_of(chosen), whole[chosen])
    assert sorted(read) == [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 19, 19]
    copy = replace(rated, codes=rated.held, name="other")
    assert copy.rated is rated.rated
    assert "codes" not in vars(rated.rated)
    np.testing.assert_array_equal(copy.codes.reshape(60 * 70, -1), whole)
    assert replace(copy, name="third").rated is rated.rated


KILLED = """
import sys, time
from pathlib import Path
import nacre.textures.limit
from nacre.runtime.journal import Journal
from nacre.runtime.store import Store
from tests.workflows.test_rating import Rate, bytes_of, recoded, texture

def slowly(*_):
    time.sleep(0.01)

nacre.textures.limit.TILE = 16
folder = Path(sys.argv[1])
with Journal(Store(folder / "x.state"), seconds=0.05) as journal:
    bytes_of(recoded(texture(), Rate(3.0), slowly, journal), folder)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills a process as Unix does")
def test_a_recoding_killed_again_and_again_ends_with_the_same_bytes(tmp_path: Path) -> None:
    whole = bytes_of(recoded(texture(), Rate(3.0)), tmp_path)
    output, state = tmp_path / "x.safetensors", tmp_path / "x.state"
    output.unlink()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    for _ in range(3):
        seen = state.stat().st_mtime_ns if state.exists() else 0
        process = subprocess.Popen([sys.executable, "-c", KILLED, tmp_path], env=environment)
        while process.poll() is None:
            if state.exists() and state.stat().st_mtime_ns != seen:
                process.send_signal(signal.SIGKILL)
                break
            time.sleep(0.02)
        assert process.wait() == -signal.SIGKILL
    subprocess.run([sys.executable, "-c", KILLED, tmp_path], env=environment, check=True)
    assert output.read_bytes() == whole
