"""Materials of equal content are equal: pickled, copied, loaded twice."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.btf import Btf, TableBtf
from nacre.formats import FORMATS
from tests.analytic.materials import EXAMPLES
from tests.contracts.directions import pairs
from tests.contracts.materials import MATERIALS
from tests.specimens import SPECIMENS
from tests.textures.codecs.basis.made import codec

COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "replaced": lambda thing: thing.replaced(),
}


def check_copies(thing: Any, use: Callable[[Any], object]) -> None:
    """Copies are equal before and after the original was used, and changed ones are not."""
    before = COPIES["pickle"](thing)
    use(thing)
    for how, copied in COPIES.items():
        assert copied(thing) == thing == before, how
        assert hash(copied(thing)) == hash(thing) == hash(before), how
    other = thing.replaced(name=f"{thing.name}, another")
    assert other != thing
    assert len({thing, before, other}) == 2
    assert thing != thing.name


@pytest.mark.parametrize("name", MATERIALS)
def test_copies_of_reflectances_are_equal(name: str) -> None:
    brdf = MATERIALS[name]()

    def use(brdf: nacre.Brdf) -> None:
        wi, wo = pairs(16)
        brdf.eval(wi, wo)
        brdf.eval(wi.astype(np.float64), wo)
        brdf.valid(wi, wo)
        brdf.sample(wo, np.full((len(wo), 3), 0.4, np.float32))
        brdf.describe()

    check_copies(brdf, use)


def _use_texture(btf: Btf) -> None:
    btf.texels(slice(0, 1))
    btf.images(slice(0, 1))
    btf.describe()


@pytest.mark.parametrize("name", [n for n in SPECIMENS if FORMATS[n].extensions])
def test_a_file_loaded_twice_is_equal(name: str, tmp_path: Path) -> None:
    specimen = SPECIMENS[name]
    if specimen.module:
        pytest.importorskip(specimen.module)
    path, elsewhere = tmp_path / specimen.name, tmp_path / "elsewhere" / specimen.name
    elsewhere.parent.mkdir()
    for each in (path, elsewhere):
        each.write_bytes(specimen.files()[0])
        for companion, content in specimen.companions.items():
            (each.parent / companion).write_bytes(content)
    first, second = nacre.load(path), nacre.load(path)
    assert first == second
    if not getattr(first, "files", ()):  # else it is what lies in the folder
        assert first == nacre.load(elsewhere)
    assert hash(first) == hash(second)
    if isinstance(first, Btf):
        check_copies(first, _use_texture)


def test_a_change_anywhere_makes_materials_unequal() -> None:
    network = MATERIALS["isotropic network"]()
    first, *others = network.layers
    weights = first.weights.copy()
    weights[0, 0] = np.nextafter(weights[0, 0], np.float32(9.0))
    assert network.with_layers([type(first)(weights, first.biases), *others]) != network
    assert network.with_layers(network.layers) == network
    assert network.replaced(sampler=nacre.CosineSampler()) != network
    assert network.replaced(source={"file": "a"}) != network
    assert MATERIALS["anisotropic network"]() != network


def test_what_is_given_in_place_of_something_computed_counts() -> None:
    ggx = EXAMPLES["ggx"]
    other = ggx.replaced(sampler=nacre.CosineSampler())
    assert other != ggx
    for how, copied in COPIES.items():
        assert copied(other) == other, how
        assert isinstance(copied(other).sampler, nacre.CosineSampler), how
    given = type(ggx)(**ggx.values, sampler=nacre.CosineSampler())
    assert isinstance(COPIES["pickle"](given).sampler, nacre.CosineSampler)


def test_textures_in_memory_are_equal_where_their_values_are() -> None:
    wi, wo = pairs(4)
    values = np.random.default_rng(0).random((2, 3, 4, 3), np.float32)
    values[0, 0, 0, 0] = np.nan
    btf = TableBtf(values, wi, wo, "a")
    assert btf == TableBtf(values.copy(), wi.copy(), wo.copy(), "a")
    assert btf != TableBtf(values, wo, wi, "a")
    assert btf != TableBtf(values + 1.0, wi, wo, "a")
    assert btf != TableBtf(values.astype(np.float64), wi, wo, "a")
    check_copies(btf, _use_texture)


def test_codecs_and_bases_are_equal_where_their_numbers_are() -> None:
    assert codec() == COPIES["pickle"](codec())
