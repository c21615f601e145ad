"""The tracer against Mitsuba's path integrator on the same triangles, and against closed forms."""

from __future__ import annotations

import errno
import os
import pickle

import numpy as np
import pytest

import nacre.runtime.parallel
from nacre.errors import NacreError
from nacre.measured.textures.domes import pairs
from nacre.textures.capture import Mesostructure, capture, gonioreflectometer
from nacre.textures.capture.gonioreflectometer import Capture
from tests.oracles.mitsuba_capture import diffuse_under_ggx, reference
from tests.textures.capture.surfaces import CELLS, bumps, directions
from tests.tiers import tiered
from tests.variants import require_mitsuba

TEXELS = 8
LIGHTS = directions((50.0, 200.0), (20.0, 70.0))
VIEWS = directions((40.0, 20.0), (55.0, 110.0))
PATCHES = np.random.default_rng(1).uniform(0.1, 0.9, (CELLS, CELLS, 3))
CASES = {
    "diffuse": (
        bumps(0.05, PATCHES),
        {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "face_albedo"}},
    ),
    "mirror facets": (
        bumps(0.05, 0.0, 1.0, (0.5, 0.25)),
        {
            "type": "roughconductor",
            "material": "none",
            "distribution": "ggx",
            "alpha_u": 0.5,
            "alpha_v": 0.25,
        },
    ),
    "both": (
        bumps(0.05, 0.6, 0.08, (0.2, 0.4)),
        {
            "type": "diffuse_under_ggx",
            "albedo": 0.6,
            "specular": 0.08,
            "along": 0.2,
            "across": 0.4,
        },
    ),
}


@pytest.mark.parametrize("case", tiered(CASES, ["mirror facets"]))
def test_values_are_those_of_mitsuba(case: str) -> None:
    """Means agree within 1 %; differences of texels are as large as their noise makes them."""
    mi = require_mitsuba()
    mi.register_bsdf("diffuse_under_ggx", diffuse_under_ggx(mi))
    surface, bsdf = CASES[case]
    wi, wo = pairs(LIGHTS, VIEWS)
    runs = np.array(
        [capture(surface, wi, wo, TEXELS, samples=128, seed=k).values for k in range(16)], float
    )
    ours, variance = runs.mean(0), runs.var(0, ddof=1) / len(runs)
    theirs, noise = reference(mi, surface, bsdf, LIGHTS, VIEWS, TEXELS, 2048)
    assert ours.mean((0, 1)) == pytest.approx(theirs.mean((0, 1)), rel=0.01)
    chi_square = ((ours - theirs) ** 2 / (variance + noise + 1e-9)).mean()
    assert 0.8 < chi_square < 1.3


def test_a_flat_diffuse_surface_gives_its_albedo() -> None:
    albedo = (0.25, 0.5, 0.75)
    wi, wo = pairs(directions((0.0, 0.0), (80.0, 10.0)), directions((5.0, 0.0), (75.0, 300.0)))
    values = capture(bumps(0.0, albedo), wi, wo, 3, 2, samples=4).values
    assert values.shape == (2, 3, 4, 3)
    assert values == pytest.approx(np.broadcast_to(albedo, values.shape), abs=2e-3)


def cosine_weighted(count: int) -> np.ndarray:
    """Directions whose density is the cosine, evenly spread (Vogel's spiral on the disc)."""
    k = np.arange(count)
    radius = np.sqrt((k + 0.5) / count)
    phi = k * np.pi * (3.0 - np.sqrt(5.0))
    z = np.sqrt(1.0 - radius**2)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1).astype(np.float32)


def test_a_white_surface_gives_back_all_light_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nacre.textures.capture.gonioreflectometer._SHADOW_RAYS", 1 << 15)
    wi, wo = pairs(cosine_weighted(200), directions((0.0, 0.0), (60.0, 30.0)))
    surface = bumps(0.06, 1.0)

    def albedo(depth: int) -> np.ndarray:
        values = capture(surface, wi, wo, 4, samples=512, depth=depth).values.astype(float)
        return values.mean((0, 1, 3)).reshape(2, -1).mean(1)

    assert (albedo(1) < 0.97).all()
    assert albedo(60) == pytest.approx(np.ones(2), abs=0.01)


def test_rough_facets_lose_light_but_make_none() -> None:
    wi, wo = pairs(cosine_weighted(200), directions((10.0, 0.0), (60.0, 30.0)))
    values = capture(bumps(0.0, 0.9, 0.04, (0.2, 0.6)), wi, wo, 1, samples=1).values.astype(float)
    albedo = values.mean((0, 1, 3)).reshape(2, -1).mean(1)
    assert ((albedo > 0.7) & (albedo < 1.0)).all()


def test_height_displaces_what_is_seen() -> None:
    """A raised flat surface is seen shifted away from the viewer by its height, at 45 degrees."""
    black_and_white = np.zeros((CELLS, CELLS, 3))
    black_and_white[: CELLS // 2, : CELLS // 2] = 1.0  # x and y below a half
    raised = 0.25
    flat = bumps(0.0, black_and_white)
    surface = Mesostructure(
        flat.height + raised, flat.albedo, flat.specular, flat.roughness, flat.direction
    )
    view = directions((45.0, 0.0))  # toward +x: a texel shows what lies at x + .25
    seen = capture(surface, directions((0.0, 0.0)), view, 4, samples=1).values[..., 0, 0]
    assert np.array_equal(seen, [[0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, 1], [1, 0, 0, 1]])


def test_walls_shadow_and_hide() -> None:
    """A ridge along y throws a shadow as long as it is high at 45 degrees."""
    height = np.zeros((CELLS, CELLS))
    height[:, :4] = 0.25
    flat = bumps(0.0, 1.0)
    surface = Mesostructure(height, flat.albedo, flat.specular, flat.roughness, flat.direction)
    above = directions((0.0, 0.0))
    values = capture(surface, directions((45.0, 180.0)), above, 16, samples=4, depth=1).values
    row = values[3, :, 0, 0]  # the ridge is in the first texel, light comes from -x
    assert (row[2:4] == 0.0).all()
    assert row[6:14] == pytest.approx(np.ones(8))


def test_the_seed_decides_and_the_number_of_threads_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wi, wo = pairs(LIGHTS, VIEWS)
    surface = bumps(0.05, PATCHES, 0.05)

    def values(seed: int, threads: int) -> np.ndarray:
        monkeypatch.setattr(nacre.runtime.parallel, "core_count", lambda: threads)
        return capture(surface, wi, wo, 5, samples=3, seed=seed).values

    assert np.array_equal(values(1, 1), values(1, 3))
    assert not np.array_equal(values(1, 3), values(2, 3))


def test_pairs_need_not_be_all_lights_with_all_views() -> None:
    surface = bumps(0.05, PATCHES, 0.05)
    wi, wo = pairs(LIGHTS, VIEWS)
    whole = capture(surface, wi, wo, 4, samples=3).values
    chosen = np.array([3, 0, 1, 3])
    assert np.array_equal(capture(surface, wi[chosen], wo[chosen], 4, samples=3).values,
                          whole[:, :, chosen])  # fmt: skip


def test_many_lights_are_taken_in_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a list of scattered pairs, two lights at a time, in bands of a row; each with its view."""
    surface = bumps(0.05, PATCHES, 0.05)
    wi = directions(*((10.0 * k, 70.0 * k) for k in range(7)))
    wo = directions(*((9.0 * k, 200.0 * k) for k in range(7)))
    again = np.array([0, 1, 2, 3, 4, 5, 6, 0, 2])
    wi, wo = wi[again], wo[np.roll(again, 1)]
    told: list[tuple[int, int]] = []
    counts: list[int] = []
    whole = capture(surface, wi, wo, 4, samples=3, seed=1).values

    def counted(*arguments: np.ndarray) -> None:
        counts.append(arguments[-1].shape[-1])
        visibility(*arguments)

    visibility = gonioreflectometer._visibility
    monkeypatch.setattr(gonioreflectometer, "_visibility", counted)
    monkeypatch.setattr(gonioreflectometer, "_VISIBLE", 4 * CELLS * CELLS)
    monkeypatch.setattr(gonioreflectometer, "_PART", 1)
    grouped = capture(
        surface, wi, wo, 4, samples=3, seed=1, progress=lambda *state: told.append(state[1:3])
    )
    assert set(counts) == {1, 2}
    np.testing.assert_allclose(grouped.values, whole, rtol=2e-3)
    assert told == [(n, len(told)) for n in range(1, len(told) + 1)]


def test_values_of_large_textures_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = bumps(0.05, PATCHES)
    wi, wo = pairs(LIGHTS, VIEWS)
    whole = capture(surface, wi, wo, 6, samples=2).values
    monkeypatch.setattr("nacre.textures.capture.gonioreflectometer._IN_MEMORY", 0)
    monkeypatch.setattr("nacre.textures.capture.gonioreflectometer._PART", 1)
    mapped = capture(surface, wi, wo, 6, samples=2).values
    assert isinstance(mapped, np.memmap)
    assert np.array_equal(mapped, whole)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full, raising=False)
    with pytest.raises(NacreError, match=r"no room for .*No space left on device; set TMPDIR"):
        _ = capture(surface, wi, wo, 6, samples=2).values


def test_texels_measured_when_asked_for_are_those_of_the_whole() -> None:
    surface = bumps(0.05, PATCHES, 0.05)
    wi, wo = pairs(LIGHTS, VIEWS)
    whole = capture(surface, wi, wo, 5, 4, samples=3, seed=2)
    found = Capture(surface, wi, wo, 5, 4, samples=3, seed=2)
    chosen, some = np.array([17, 3, 4, 5, 0]), np.array([2, 0])
    for one in (found, pickle.loads(pickle.dumps(found))):
        np.testing.assert_array_equal(one.texels(chosen), whole.texels(chosen))
        np.testing.assert_array_equal(one.texels(slice(7, 12)), whole.texels(slice(7, 12)))
    np.testing.assert_array_equal(found.texels_at(chosen, some), whole.texels_at(chosen, some))
    np.testing.assert_array_equal(found.images(slice(1, 3)), whole.images(slice(1, 3)))


def test_values_without_room_are_refused_before_work_begins() -> None:
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    with pytest.raises(NacreError, match="TMPDIR"):
        capture(bumps(0.0), up, up, 1 << 24)


@pytest.mark.parametrize("height", [-1.0, 0.0])
def test_directions_at_or_below_the_horizon_are_refused(height: float) -> None:
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    low = np.array([[np.sqrt(1.0 - height**2), 0.0, height]], np.float32)
    with pytest.raises(ValueError, match="horizon"):
        capture(bumps(0.0), low, up, 2)
