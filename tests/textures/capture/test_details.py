"""Details of surfaces: fibers, seams, pores and finish, and that surfaces without them stay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.textures.capture import Recipe, find
from nacre.textures.capture.generators import GENERATORS
from nacre.textures.capture.generators.fibers import spun
from nacre.textures.capture.mesostructure import Mesostructure

SHOWPIECES = sorted((Path(__file__).parents[3] / "gallery" / "recipes").glob("*.json"))
WITHOUT = {
    "fabric05": (0.024746180, 0.135184268, 1.270817862, 0.029217911),
    "fabric09": (0.008329042, 0.013681353, 1.234002323, 0.080000000),
    "leather04": (0.006547054, 0.422267118, 0.000000000, 0.040000000),
    "leather11": (0.017212128, 0.136127825, 0.000000000, 0.050000000),
    "wood06": (0.006767236, 0.243076840, 1.570796327, 0.049987221),
    "wood11": (0.001169762, 0.369900259, 1.570796327, 0.056954804),
    "felt03": (0.008224567, 0.654157500, 1.649011783, 0.038537047),
}
"""What surfaces of 32 cells were like before there were such details."""


def surface(family: str, size: int = 128, **parameters: Any) -> Mesostructure:
    return Recipe("x", GENERATORS[family].from_json(parameters), 5).build(size)


@pytest.mark.parametrize("name", WITHOUT)
def test_recipes_without_details_make_what_they_made(name: str) -> None:
    made = find(name).build(32)
    found = made.height.std(), made.albedo.mean(), abs(made.direction).mean(), made.specular.mean()
    assert found == pytest.approx(WITHOUT[name], abs=1e-8)


@pytest.mark.parametrize("path", SHOWPIECES, ids=lambda path: path.stem)
def test_a_showpiece_tiles(path: Path) -> None:
    made = find(path).build(192)
    for axis in (0, 1):
        steps = abs(made.height - np.roll(made.height, 1, axis)).mean(1 - axis)
        assert steps[0] <= 1.5 * steps[1:].max()


def test_there_are_three_showpieces() -> None:
    assert [path.stem for path in SHOWPIECES] == ["leather", "tweed", "wood"]


def test_fibers_wind_around_strands() -> None:
    """Two strands, each with its own; all of them come up, and go on over the seam."""
    size, count, turns = 240, 6, 3
    x, y = np.broadcast_to(np.arange(size) / size, (size, size)), np.arange(size)[:, None] / size
    strand = (2.0 * x).astype(int)
    side = 2.0 * (2.0 * x % 1.0) - 1.0
    found = spun(np.random.default_rng(0), side, y + 0.0 * x, strand, count, turns)
    assert np.array_equal(found.fiber // (2 * count), strand)
    assert len(np.unique(found.fiber)) == 2 * 2 * count
    assert (found.fiber[0] == found.fiber[-1]).mean() > 0.8
    # Twelve in a turn, so along a line each comes up once a turn; wandering ones more often.
    changes = (np.diff(found.fiber[:, size // 4]) != 0).sum()
    assert changes >= 2 * count * turns - 1
    assert 0.0 <= found.shade.min() < found.shade.max() <= 1.0


def test_stray_fibers_lie_on_cloth() -> None:
    plain = {"strands": 8, "fuzz": 0.0, "warp": ["#ff0000"], "weft": ["#ff0000"]}
    count, length = 40, 2.0
    bare = surface("fabric", 512, **plain)
    hairy = surface("fabric", 512, **plain, strays=count, stray_length=length)
    rise = (hairy.height - hairy.height.min()) - (bare.height - bare.height.min())
    assert rise.min() > -1e-9
    radius = 0.2 * 0.95 / (8 * 4)
    area = count * length / 8 * 2.0 * radius
    assert 0.4 * area < (rise > 1e-6).mean() < 1.1 * area


def test_melange_mixes_the_colors_of_strands() -> None:
    dyed = {"warp": ["#ff0000"], "weft": ["#0000ff"], "fibers": 6, "variation": 0.0}
    pure, mixed = (surface("fabric", **dyed, melange=amount).albedo for amount in (0.0, 1.0))
    assert not (pure[..., 0] * pure[..., 2] > 1e-9).any()
    warp = (pure[..., 0] > 0.0).mean()
    assert 0.3 < warp < 0.7
    red_becomes_blue = (mixed[..., 2] > 0.0) & (pure[..., 0] > 0.0)
    assert red_becomes_blue.mean() == pytest.approx(0.5 * warp, abs=0.12)


def test_uneven_strands_are_where_even_ones_are_about() -> None:
    even, uneven = (surface("fabric", strands=4, fuzz=0.0, unevenness=u).height for u in (0.0, 0.3))
    assert np.corrcoef(even.ravel(), uneven.ravel())[0, 1] > 0.5
    assert abs(even - uneven).max() > 0.01


@pytest.mark.parametrize("stitches", [5, 12])
def test_a_seam_has_so_many_stitches(stitches: int) -> None:
    plain = {"palette": ["#000000"], "specular": 0.0, "bumps": 6, "depth": 0.0}
    sewn = surface("leather", 512, **plain, stitches=stitches, thread=["#00ff00"])
    thread = sewn.albedo[..., 1] > 0.0
    rows = np.flatnonzero(thread.mean(0) > 0.6)
    left, right = rows[rows < 256], rows[rows > 256]
    assert len(left) > 3
    assert len(right) > 3
    for column in (left[len(left) // 2], right[len(right) // 2]):
        line = thread[:, column]
        assert (line & ~np.roll(line, 1)).sum() == stitches
    middle = sewn.height[:, 252:260].mean()
    assert middle < sewn.height[:, :64].mean() - 0.02  # the groove between the edges
    assert not thread[:, 250:262].any()
    assert not surface("leather", 64, **plain).albedo.any()


def test_creases_that_wander_are_as_many() -> None:
    straight, bent = (surface("leather", bumps=8, wander=w, grain=0.0) for w in (0.0, 1.0))
    assert bent.height.std() == pytest.approx(straight.height.std(), rel=0.1)
    assert np.corrcoef(bent.height.ravel(), straight.height.ravel())[0, 1] < 0.9
    creased = surface("leather", bumps=8, fine_creases=1.0)
    assert creased.albedo.mean() < surface("leather", bumps=8).albedo.mean()


def test_a_finish_fills_and_deepens_and_shines_alike() -> None:
    bare, coated = (
        surface("wood", pores=0.6, relief=0.02, finish=f, finish_roughness=0.2) for f in (0.0, 1.0)
    )
    assert np.ptp(coated.height) == pytest.approx(0.2 * np.ptp(bare.height), rel=1e-6)
    assert (coated.albedo < bare.albedo).all()
    saturated = [(a.max(-1) / a.min(-1)).mean() for a in (bare.albedo, coated.albedo)]
    assert saturated[1] > saturated[0]
    assert np.allclose(coated.roughness, 0.2)
    assert np.ptp(bare.roughness) > 0.1


def test_fine_pores_lie_in_early_wood() -> None:
    wood = {"pores": 0.0, "rings": 4, "contrast": 1.0, "palette": ["#ffffff", "#808080"]}
    plain, few, many = (surface("wood", 256, **wood, fine_pores=f).albedo for f in (0.0, 0.3, 0.8))
    porous = [(plain - with_pores)[..., 0] > 0.05 for with_pores in (few, many)]
    assert 0.0 < porous[0].mean() < porous[1].mean() < 0.5
    early = plain[..., 0] > 0.6
    assert porous[0][early].mean() > 2.0 * porous[0][~early].mean()
    rays = surface("wood", 256, **wood, rays=0.5).albedo
    assert 0.0 < ((plain - rays)[..., 0] > 0.05).mean() < 0.2
