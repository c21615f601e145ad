"""The textures of the gallery: each is what its recipe makes, in few bytes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.formats import load_btf
from nacre.textures.capture import capture, find
from nacre.textures.height_file import read_heights
from nacre.textures.latent_map import NeuralBtf
from tests.tiers import tiered
from tests.variants import require_mitsuba

GALLERY = Path(__file__).parents[2] / "gallery"
TEXTURES = sorted((GALLERY / "textures").glob("*.safetensors"))
LIGHTS = np.array([[0.5, 0.2, 0.84], [-0.3, 0.6, 0.74]], np.float32)
VIEWS = np.array([[0.05, -0.2, 0.98], [0.3, 0.1, 0.95]], np.float32)
"""Not those of the captures."""


def directions(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), np.float32)


def coarse(pictures: np.ndarray) -> np.ndarray:
    """Means of blocks of 8 x 8 texels, shape (n, 32, 32, ...)."""
    n, height, width, *rest = pictures.shape
    blocks = pictures.reshape(n, 32, height // 32, 32, width // 32, *rest)
    return np.asarray(blocks.mean(axis=(2, 4)), np.float64)


@pytest.mark.parametrize("path", tiered(TEXTURES, TEXTURES[:1]), ids=lambda path: path.stem)
def test_a_texture_is_what_its_recipe_makes(path: Path) -> None:
    """In light and from directions that it was not captured at, on a coarser grid."""
    assert path.stat().st_size < 1_500_000
    btf = load_btf(path)
    assert isinstance(btf, NeuralBtf)
    assert (btf.width, btf.height) == (256, 256)
    wi, wo = directions(LIGHTS), directions(VIEWS)
    shown = coarse(btf.at_directions(wi, wo).images(slice(None)))
    surface = find(GALLERY / "recipes" / f"{path.stem}.json").build(512)
    made = capture(surface, wi, wo, 64, samples=32, on_surface=True)
    wanted = coarse(made.images(slice(None)).astype(np.float32))
    for one, other in zip(shown, wanted, strict=True):
        assert one.mean((0, 1)) == pytest.approx(other.mean((0, 1)), rel=0.1)
        assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.93
    require_mitsuba()
    heights = read_heights(path.with_suffix(".exr"))
    assert heights.shape == (256, 256)
    relief = coarse(heights[None])[0], coarse(surface.height_map()[None])[0]
    assert np.corrcoef(*(part.ravel() for part in relief))[0, 1] > 0.97


def test_there_is_a_texture_of_every_recipe() -> None:
    recipes = sorted(path.stem for path in (GALLERY / "recipes").glob("*.json"))
    assert [path.stem for path in TEXTURES] == recipes
