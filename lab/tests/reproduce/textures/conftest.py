"""A folder of tiny textures of two families, and a study of them."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")
pytest.importorskip("matplotlib", reason="needs the extra 'plot'")

from nacre.textures.codecs.basis.recipe import BasisRecipe
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.textures.materials import collect, separate
from nacre_lab.reproduce.textures.methods import TrainingSettings
from nacre_lab.reproduce.textures.study import Study
from tests.textures.codecs.networks.conftest import one_thread
from tests.textures.codecs.networks.made import OTHER, texture
from tests.textures.made import write

__all__ = ["one_thread"]

BASIS = replace(
    BasisRecipe(),
    code_dim=8,
    luma_count=12,
    chroma_count=4,
    width=16,
    wide=24,
    hidden=8,
    function_steps=20,
    code_steps=20,
)
SETTINGS = TrainingSettings(steps=3, texels=20, basis=BASIS)


@pytest.fixture(scope="package")
def folder(tmp_path_factory):
    """Six materials, of which two are unseen, and one at other directions."""
    where = tmp_path_factory.mktemp("textures")
    for index, name in enumerate(("felt01", "felt02", "felt12", "wood_1", "wood_2", "wood_12")):
        write(texture(index), where / "bonn" / f"{name}.npz")
    write(texture(9, directions=OTHER), where / "utia" / "silk12.npz")
    return where


@pytest.fixture
def study(folder, tmp_path_factory):
    """What is kept lasts for all tests."""
    training, unseen = separate(collect([folder / "bonn"]))
    calls = []
    found = Study(
        training,
        unseen,
        SETTINGS,
        Cache(folder / "cache"),
        others=collect([folder / "utia"]),
        progress=lambda *call: calls.append(call),
    )
    found.calls = calls
    return found
