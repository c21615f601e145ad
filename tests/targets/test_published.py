"""Networks in the files of the NBRDF authors, read as their code reads them."""

from __future__ import annotations

import io
import json

import h5py
import numpy as np
import pytest

import nacre
from nacre.errors import NacreError
from nacre.geometry import half_difference, split
from nacre.io.marks import read_mark
from nacre.io.outputs import written_by
from nacre.targets import TARGETS, export
from tests.oracles.materials import material
from tests.oracles.pairs import pairs
from tests.oracles.runner import reference, worst_error


def plugin(files, name, wi, wo):
    """`Net::forward` of the authors' plugin, whose `nn_basename` is NAME_, and what it is given."""
    h, d = half_difference(split(wi), split(wo))
    theta = np.arctan2(np.hypot(h[0], h[1]), h[2])
    x = np.stack([np.sin(theta), np.zeros(len(wi)), np.cos(theta), *d], axis=1)
    for index in (1, 2, 3):
        weights, biases = (
            np.load(io.BytesIO(files[f"{name}_{part}{index}.npy"])) for part in ("fc", "b")
        )
        assert (weights.dtype, biases.dtype) == (np.dtype("<f4"), np.dtype("<f4"))
        x = x @ weights + biases
        x = np.maximum(x, 0.0) if index < 3 else np.maximum(np.exp(x) - 1.0, 0.0)
    return x


def test_the_authors_plugin_reads_the_reflectance():
    wi, wo = (w[:20_000].astype(np.float64) for w in pairs(40_000))
    files = TARGETS["npy"]().files(material("diffuse"), "paint")
    assert [name for name in files if name.endswith(".npy")] == [
        f"paint_{part}{index}.npy" for index in (1, 2, 3) for part in ("fc", "b")
    ]
    for content in files.values():  # their reader knows no other version and order
        assert content[:8] == b"\x93NUMPY\x01\x00" or b"2700 memory bytes" in content
        assert b"'fortran_order': True" not in content
    found = plugin(files, "paint", wi, wo)
    assert worst_error(found, reference(material("diffuse"), "eval", wi, wo)) <= 1.0


def test_keras_finds_each_layer_of_the_json_in_the_weights():
    files = TARGETS["h5"]().files(material("diffuse"), "paint")
    layers = json.loads(files["paint.json"])["config"]["layers"]
    assert layers[0]["config"]["input_shape"] == [6]
    with h5py.File(io.BytesIO(files["paint.h5"])) as file:
        assert "2700 memory bytes" in file.attrs["description"]
        names = [
            n.decode() for n in file.attrs["layer_names"] if len(file[n].attrs["weight_names"])
        ]
        assert names == [layer["config"]["name"] for layer in layers]
        for layer, ours in zip(layers, material("diffuse").layers, strict=True):
            group = file[layer["config"]["name"]]
            stored = [group[name][()] for name in group.attrs["weight_names"]]
            assert stored[1].shape == (layer["config"]["units"],)
            for one, other in zip(stored, ours, strict=True):
                np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("target", "file"), [("npy", "paint_fc1.npy"), ("h5", "paint.h5")])
def test_what_is_written_is_read_again(tmp_path, target, file):
    export(material("diffuse"), target, f"{tmp_path}/", name="paint")
    again = nacre.load(tmp_path / file)
    for one, other in zip(again.layers, material("diffuse").layers, strict=True):
        np.testing.assert_array_equal(one.weights, other.weights)


def test_the_files_of_keras_are_replaced_by_the_next_run(tmp_path):
    """Both say who wrote them."""
    for _ in range(2):
        with written_by("nacre export"):
            written = export(material("diffuse"), "h5", f"{tmp_path}/", name="paint")
    assert [read_mark(path).command for path in written] == ["nacre export"] * 2


@pytest.mark.parametrize("target", ["npy", "h5"])
@pytest.mark.parametrize("name", ["glossy", "anisotropic", "scan", "ggx"])
def test_what_the_authors_code_cannot_hold_is_refused(target, name):
    with pytest.raises(NacreError, match=r"takes isotropic networks 6-21-21-3 .*--inputs paper"):
        TARGETS[target]().files(material(name), "x")
