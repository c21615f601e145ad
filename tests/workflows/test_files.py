"""Lone files: where fits go, what one failure costs, and what is in a file of any kind."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.errors import FormatError, NacreError
from nacre.measured.textures import UTIA
from nacre.workflows import (
    Watcher,
    fit_files,
    inspect,
    output_paths,
    texture_reflectance,
)
from tests.cli.support import run
from tests.workflows.support import QUICK, table


class Heard(Watcher):
    """Keeps what a run says."""

    def __init__(self):
        self.total, self.ended = 0, {}

    def begin(self, materials):
        self.total = materials

    def end(self, name, error):
        self.ended[name] = error


def test_a_failure_costs_only_its_own_file(tmp_path):
    paths = [table(tmp_path / f"{name}.binary") for name in ("a", "b")]
    bad = tmp_path / "bad.binary"
    bad.write_bytes(b"bad")
    outputs = [tmp_path / "a.safetensors", tmp_path / "absent/b.safetensors", tmp_path / "c.h5"]
    heard = Heard()
    found = fit_files([*paths, bad], outputs, QUICK, watcher=heard)
    assert [file.output for file in found] == outputs
    first, second, third = (file.fit for file in found)
    assert (first.error, first.content) == (None, b"")
    assert "675" not in first.summary
    assert "weights" in first.summary
    assert nacre.load(outputs[0]).metadata["quality"] == first.losses
    assert "does not exist" in second.error
    assert "is of no known format" in third.error
    assert heard.total == 2
    assert set(heard.ended) == {"a.binary", "bad.binary"}


def test_a_measurement_is_opened_for_its_head_to_be_read_and_to_be_hashed(tmp_path, monkeypatch):
    path = table(tmp_path / "a.binary")
    os.utime(path, (1e9, 1e9))
    opened, really = [], Path.open
    monkeypatch.setattr(Path, "open", lambda p, *a, **k: (opened.append(p), really(p, *a, **k))[1])
    assert run("fit", path, "-o", tmp_path / "a.json", "--model", "lambert") == 0
    assert opened.count(path) == 3


def test_a_name_that_is_too_long_costs_only_its_own_file(tmp_path):
    paths = [table(tmp_path / f"{name}.binary") for name in ("a" * 246, "b")]
    found = fit_files(paths, output_paths(paths, f"{tmp_path}/out/", ".safetensors"), QUICK)
    errors = [file.fit.error for file in found]
    assert "File name too long" in errors[0]
    assert errors[1] is None
    assert found[1].output.exists()


def test_inputs_are_never_outputs(tmp_path):
    path = table(tmp_path / "a.binary")
    before = path.read_bytes()
    (found,) = fit_files([path], [path], QUICK)
    assert "is the input as well" in found.fit.error
    assert path.read_bytes() == before


def test_outputs_are_files_or_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ending = ".safetensors"
    assert str(output_paths(["x/a.binary"], None, ending)[0]) == "a.safetensors"
    assert str(output_paths(["a.binary"], "b.h5", ending)[0]) == "b.h5"
    assert str(output_paths(["a.binary"], "new/", ending)[0]) == "new/a.safetensors"
    assert str(output_paths(["a.binary"], "new", ending)[0]) == "new/a.safetensors"
    assert len(output_paths(["a.binary", "b.binary"], "more", ending)) == 2
    for paths, output, words in (
        (["a.binary"], "other", "write other.safetensors for a file or other/ for a folder"),
        (["a.binary", "b.binary"], "b.h5", "must be a folder for several files"),
        (["x/a.binary", "y/a.binary"], None, "two fits would have the same name"),
    ):
        with pytest.raises(FormatError, match=words):
            output_paths(paths, output, ending)


def test_a_texel_is_a_reflectance():
    wi, wo = (w[::50] for w in UTIA.pairs())
    values = np.linspace(0.1, 0.6, 6, dtype="f4").reshape(2, 3, 1, 1)
    texture = TableBtf(np.broadcast_to(values, (2, 3, len(wi), 3)), wi, wo, "cloth")
    for texel, value in ((None, 0.35), ((2, 1), 0.6), ((0, 0), 0.1)):
        f_r = texture_reflectance(texture, texel).eval(wi[:5], wo[:5])
        np.testing.assert_allclose(np.pi * f_r, value, rtol=1e-4)
    with pytest.raises(NacreError, match="has 3 x 2 texels, none in column 3"):
        texture_reflectance(texture, (3, 0))


def test_files_say_what_they_are(tmp_path):
    found = inspect(table(tmp_path / "a.binary"), physics=False)
    assert (found.kind, found.facts["isotropic"]) == ("brdf", True)
    assert found.units["bytes"] == "bytes"
    assert found.brdf is not None
    with pytest.raises(FormatError, match="no such file"):
        inspect(tmp_path / "absent.bsdf")
