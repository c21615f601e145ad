"""Kinds of materials by name."""

from __future__ import annotations

from dataclasses import replace

import pytest

from nacre.errors import NacreError
from nacre.latent import pretrained_basis
from nacre.latent.kinds import KINDS, kinds, members
from tests.latent.made import random_basis


def test_a_material_is_of_the_first_kind_that_its_name_tells_of():
    names = ["acrylic_felt_orange_rgb", "gold-metallic-paint", "SS440", "violet-acrylic", "leaf"]
    assert kinds(names) == {"fabric": [0], "paint": [1], "metal": [2], "plastic": [3]}


def test_every_kind_is_in_the_included_basis():
    names = pretrained_basis().metadata["materials"]
    found = kinds(names)
    assert set(found) == set(KINDS)
    indices = [index for group in found.values() for index in group]
    assert len(indices) == len(set(indices))
    assert {names[k] for k in members(pretrained_basis(), "metal")} >= {"chrome", "nickel", "steel"}
    assert [names[k] for k in members(pretrained_basis(), "Marble")] == ["white-marble"]


def test_what_is_unlike_all_names_is_refused_with_the_kinds_there_are():
    basis = replace(random_basis(), metadata={"materials": ["red-fabric", "x", "y", "z", "w"]})
    assert members(basis, "fabric") == [0]
    with pytest.raises(NacreError, match="no material like 'steel'; kinds are fabric"):
        members(basis, "steel")
    with pytest.raises(NacreError, match="their names tell no kind"):
        members(random_basis(), "")
