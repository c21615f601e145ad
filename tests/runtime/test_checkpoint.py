"""States of trainings: those of a machine with a GPU are read on one without."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra 'latent'")
import torch

from nacre.errors import FormatError
from nacre.runtime.checkpoint import load_state, save_state


def test_tensors_of_a_gpu_are_read_to_the_processor(tmp_path: Path):
    path, other = tmp_path / "here.state", tmp_path / "gpu.state"
    save_state(path, "made", {"values": torch.arange(5.0)})
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith("data.pkl"):  # texts are preceded by X and their length
                assert b"X\x03\0\0\0cpu" in content
                content = content.replace(b"X\x03\0\0\0cpu", b"X\x06\0\0\0cuda:0")
            target.writestr(name, content)
    values = load_state(other, "made", lambda state: state["values"])
    assert values.device.type == "cpu"
    assert values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_state_that_finds_no_room_is_an_error_with_its_name(tmp_path: Path):
    resource = pytest.importorskip("resource", reason="files have no largest size here")
    path = tmp_path / "full.state"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(FormatError, match=r"full\.state: cannot be written: File too large"):
            save_state(path, "made", {"values": torch.zeros(100_000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())
