"""What targets cannot hold: one line that says what to do."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.measured.merl import Resolution, tabulate
from nacre.neural import Layer, NeuralBrdf
from nacre.targets import TARGETS
from nacre.targets.target import TABLES, TEXTURES, WIDE
from tests.oracles.materials import material
from tests.oracles.pairs import pairs
from tests.oracles.runner import reference, worst_error
from tests.targets.test_tensors import outputs
from tests.tiers import tiered


class _Spectral(Brdf):
    """A diffuse material of three bands."""

    wavelengths = np.array([400.0, 550.0, 700.0])

    def eval_components(self, wi, wo):
        return 0.1 + 0.0 * wi[2], 0.2 + 0.0 * wi[2], 0.3 + 0.0 * wi[2]


@cache
def wide() -> NeuralBrdf:
    """A network of 17,539 weights."""
    random = np.random.default_rng(0)
    sizes = itertools.pairwise((6, 128, 128, 3))
    return NeuralBrdf([Layer(random.normal(0, 0.1, s), np.zeros(s[1])) for s in sizes], name="big")


@cache
def table() -> Brdf:
    return tabulate(material("glossy"), Resolution(6, 6, 6)).replaced(name="tabulated")


@pytest.mark.parametrize(
    "target",
    tiered(
        [name for name, kind in TARGETS.members() if not kind.model],
        lambda name: name != "mdl",  # which tabulates
    ),
)
@pytest.mark.parametrize(
    ("what", "made", "words"),
    [
        (
            WIDE,
            wide,
            r"big: \d\d,\d+ weights are more .*--hidden 64,64 .* c, onnx, pytorch or mdl",
        ),
        (
            TABLES,
            table,
            r"tabulated: .* tables: fit .*\(nacre fit\); export it --to onnx, pytorch or mdl",
        ),
    ],
    ids=["wide", "table"],
)
def test_a_target_holds_it_or_says_which_do(target, what, made, words):
    if target in ("npy", "h5"):
        words = r"takes isotropic networks 6-21-21-3 .*--to onnx"
    if what in TARGETS[target].holds:
        assert all(TARGETS[target]().files(made(), "x").values())
        return
    with pytest.raises(NacreError, match=words) as error:
        TARGETS[target]().files(made(), "x")
    assert str(error.value).count(made().name) == 1


@pytest.mark.parametrize("target", list(TARGETS))
def test_no_target_drops_spectra_or_texels_silently(target):
    with pytest.raises(NacreError, match=r"is spectral, and all targets hold RGB: fit a network"):
        TARGETS[target]().files(_Spectral(name="band"), "x")
    if TEXTURES not in TARGETS[target].holds:
        texture = TableBtf(np.zeros((1, 1, 1, 3)), *(np.array([[0.0, 0.0, 1.0]]),) * 2)
        with pytest.raises(NacreError, match=r"is a texture, .*; export it --to .* or onnx"):
            TARGETS[target]().files(texture, "x")


@pytest.mark.parametrize("target", tiered(["onnx", "pytorch"], ["onnx"]))
@pytest.mark.parametrize("made", [wide, table])
def test_what_is_said_to_hold_it_computes_it(target, made):
    wi, wo = pairs(4000)
    for function in ("eval", "pdf"):
        found = outputs(target, made(), function, wi, wo)
        assert worst_error(found, reference(made(), function, wi, wo)) <= 1.0


def test_measured_tables_of_files_are_held(tmp_path):
    nacre.save(table(), tmp_path / "x.npz")
    loaded = nacre.load(tmp_path / "x.npz")
    assert len(TARGETS["onnx"]().files(loaded, "x")) == 3
