"""The UTIA reader and writer against a scalar lookup, and against damaged files."""

from __future__ import annotations

import functools
import itertools
import math
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.measured import UtiaBrdf, utia
from nacre.measured.utia import SHAPE
from tests.measured import support
from tests.variants import require_mitsuba

from .support import assert_same_in_drjit, assert_same_in_torch, hemisphere, write

SIZE = 288 * 288 * 3 * 8


@dataclass
class Brushed(Brdf):
    """A smooth anisotropic reflectance that is not reciprocal; a stand-in for a measurement."""

    name: str = "brushed"
    isotropic: bool = False
    blind: float = 0.0
    """Directions to the light lower than this (cosine) are not known."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        grain = (wi[0] + wo[0]) ** 2
        return 0.5 + 0.1 * grain, 0.4 + 0.2 * wi[1], 0.3 + 0.1 * wo[0] * wi[2]

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return (wi[2] > self.blind) & (wo[2] > 0.0)


def random_table(seed: int = 0, invalid: float = 0.0) -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    table = rng.random(SHAPE, dtype=np.float32)
    table[:, rng.random(SHAPE[1:]) < invalid] = -1.0
    return table


def utia_bytes(table: npt.NDArray[np.floating]) -> bytes:
    return table.astype("<f8").tobytes()


def directions(theta: npt.ArrayLike, phi: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Unit vectors of angles in degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack(np.broadcast_arrays(x, y, np.cos(theta)), -1)


def nodes() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Directions (wi, wo) of every node, in shapes that broadcast to (6, 48, 6, 48, 3)."""
    grid = directions(15.0 * np.arange(6)[:, None], 7.5 * np.arange(48))
    return grid[:, :, None, None], grid[None, None]


def reference(values: list[float], wi: npt.ArrayLike, wo: npt.ArrayLike) -> list[float]:
    """One lookup as the database describes it: degrees, offsets in the file, 16 terms."""

    def polar(w: list[float]) -> list[tuple[int, float]]:
        theta = math.degrees(math.acos(w[2]))
        low = min(int(theta // 15.0), 4)
        part = (theta - 15.0 * low) / 15.0  # more than 1 beyond 75 degrees
        return [(low, 1.0 - part), (low + 1, part)]

    def azimuth(w: list[float]) -> list[tuple[int, float]]:
        phi = math.degrees(math.atan2(w[1], w[0])) % 360.0
        low = int(phi // 7.5)
        part = (phi - 7.5 * low) / 7.5
        return [(low % 48, 1.0 - part), ((low + 1) % 48, part)]

    light, view = np.asarray(wi, float).tolist(), np.asarray(wo, float).tolist()
    rgb = [0.0] * 3
    terms = itertools.product(polar(light), azimuth(light), polar(view), azimuth(view))
    for (ti, a), (pi, b), (tv, c), (pv, d) in terms:
        for plane in range(3):
            offset = plane * 288 * 288 + (48 * ti + pi) * 288 + 48 * tv + pv
            rgb[plane] += a * b * c * d * values[offset]
    return [max(channel, 0.0) for channel in rgb]


@pytest.fixture(scope="module")
def tabulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("utia") / "brushed.bin"
    utia.save(Brushed(), path)
    return path


def test_lookup_is_that_of_the_database(tmp_path: Path) -> None:
    table = random_table()
    brdf = utia.load(write(tmp_path / "random.bin", utia_bytes(table)))
    rng = np.random.default_rng(1)
    wi, wo = (hemisphere(rng, 3000).astype(float) for _ in range(2))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    measured = (wi[:, 2] > math.cos(math.radians(75))) & (wo[:, 2] > math.cos(math.radians(75)))
    assert 0.4 < measured.mean() < 0.7
    values = table.ravel().tolist()
    expected = np.array([reference(values, a, b) for a, b in zip(wi, wo, strict=True)])
    assert (expected[~measured] == 0.0).any(), "some extrapolated values are negative"
    np.testing.assert_allclose(brdf.eval(wi, wo), expected, rtol=1e-4, atol=2e-6)


def test_nodes_stand_where_documented() -> None:
    table = random_table()
    values = UtiaBrdf(table).eval(*nodes())
    expected = np.moveaxis(table, 0, -1)
    np.testing.assert_allclose(values[1:, :, 1:], expected[1:, :, 1:], rtol=1e-5, atol=1e-6)
    # The azimuth is free at the pole: that of node 0 stands for it.
    np.testing.assert_allclose(values[0, 3, 1:], expected[0, 0, 1:], rtol=1e-5, atol=1e-6)


def test_light_and_view_are_not_exchanged() -> None:
    table = np.zeros(SHAPE)
    table[:, 2, 4, 3, 10] = 1.0
    brdf = UtiaBrdf(table)
    light, view = directions(30.0, 30.0), directions(45.0, 75.0)
    np.testing.assert_allclose(brdf.eval(light, view), 1.0, rtol=1e-6)
    np.testing.assert_array_equal(brdf.eval(view, light), 0.0)


@pytest.mark.parametrize("theta", [76.0, 80.0, 89.9])
def test_the_line_goes_on_beyond_the_last_node(theta: float) -> None:
    steps = 2.0 + np.arange(6.0)
    brdf = UtiaBrdf(np.broadcast_to(steps[:, None, None, None], SHAPE))
    low = directions(theta, np.arange(0.0, 360.0, 5.0))
    np.testing.assert_allclose(brdf.eval(low, directions(20.0, 3.0)), 2 + theta / 15, rtol=1e-6)
    assert brdf.valid(low, directions(20.0, 3.0)).all()
    np.testing.assert_allclose(brdf.eval(directions(20.0, 3.0), low), 2 + 20 / 15, rtol=1e-6)


def test_invalid_nodes_do_not_pollute_the_others() -> None:
    table = np.ones(SHAPE)
    table[:, 2:4, 10:20, 1:3] = -5.0
    table[1, 5, 30, 5, 40] = -1.0  # one negative channel makes the sample invalid
    brdf = UtiaBrdf(table)
    assert (~brdf.mask).sum() == 2 * 10 * 2 * 48 + 1
    rng = np.random.default_rng(4)
    wi, wo = hemisphere(rng, 20_000), hemisphere(rng, 20_000)
    values, valid = brdf.eval(wi, wo), brdf.valid(wi, wo)
    known = values[:, 0] > 0.0
    np.testing.assert_allclose(values[known], 1.0, rtol=1e-4)
    assert not valid[~known].any()
    assert (~valid & known).any(), "cells with some invalid nodes are evaluated but not valid"
    # Below an invalid node nothing is known to go on from; its neighbors stand in for it.
    beside = directions(80.0, 7.5 * 30.25), directions(80.0, 7.5 * 40.25)
    assert not brdf.valid(*beside)
    np.testing.assert_allclose(brdf.eval(*beside), 1.0, rtol=1e-5)


def test_a_table_of_nothing_is_black() -> None:
    brdf = UtiaBrdf(np.full(SHAPE, -1.0))
    rng = np.random.default_rng(5)
    wi, wo = hemisphere(rng, 100), hemisphere(rng, 100)
    np.testing.assert_array_equal(brdf.eval(wi, wo), 0.0)
    assert not brdf.valid(wi, wo).any()
    assert brdf.describe()["value range"] is None


def test_array_libraries_agree() -> None:
    for brdf in (utia.tabulate(Brushed()), UtiaBrdf(random_table(invalid=0.1))):
        assert_same_in_torch(brdf, share=0.99)
        assert_same_in_drjit(brdf, require_mitsuba(), share=0.99)


def test_directions_outside_the_table_do_not_raise() -> None:
    brdf = UtiaBrdf(random_table())
    up = np.array([[0.0, 0.0, 1.0]])
    for other in ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0]):
        assert (brdf.eval(up, other) == 0.0).all()
        assert (brdf.eval(other, up) == 0.0).all()
        assert not brdf.valid(up, other).any()


def test_azimuths_close_the_circle() -> None:
    brdf = UtiaBrdf(random_table())
    view = directions(40.0, 100.0)
    for below in (-1e-13, -1e-30, 360.0, 720.0 - 1e-12):
        np.testing.assert_allclose(
            brdf.eval(directions(50.0, below), view), brdf.eval(directions(50.0, 0.0), view)
        )


# Tabulating and files


def test_tabulated_material_is_close_to_its_source(tabulated: Path) -> None:
    brdf = utia.load(tabulated)
    rng = np.random.default_rng(5)
    wi, wo = hemisphere(rng, 20_000), hemisphere(rng, 20_000)
    inside = (wi[:, 2] > 0.26) & (wo[:, 2] > 0.26)
    assert brdf.valid(wi, wo).all()
    expected = Brushed().eval(wi[inside], wo[inside])
    np.testing.assert_allclose(brdf.eval(wi[inside], wo[inside]), expected, atol=0.015)


def test_what_the_source_does_not_know_stays_unknown() -> None:
    brdf = utia.tabulate(Brushed(blind=0.6))
    wi, _ = nodes()
    known = np.broadcast_to(wi[..., 2] > 0.6, SHAPE[1:])
    np.testing.assert_array_equal(brdf.mask, known)
    assert (brdf.stored[:, ~known] == utia.INVALID).all()


def test_saved_file_comes_back_byte_for_byte(tabulated: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.bin"
    utia.save(utia.load(tabulated), again)
    assert again.read_bytes() == tabulated.read_bytes()
    assert tabulated.stat().st_size == SIZE
    data = utia_bytes(random_table(invalid=0.2))
    nacre.save(nacre.load(write(tmp_path / "random.bin", data)), again)
    assert again.read_bytes() == data


def test_writing_into_an_absent_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="does not exist; create it first"):
        utia.save(UtiaBrdf(random_table()), tmp_path / "absent" / "a.bin")


def test_the_name_decides_where_content_cannot(tabulated: Path, tmp_path: Path) -> None:
    brdf = nacre.load(tabulated)
    assert isinstance(brdf, UtiaBrdf)
    assert brdf.name == "brushed"
    with pytest.raises(FormatError, match="no known format"):
        nacre.load(write(tmp_path / "brushed.dat", tabulated.read_bytes()))
    merl = tmp_path / "merl.binary"
    nacre.save(nacre.measured.MerlBrdf(np.ones((3, 4, 4, 4))), merl)
    renamed = nacre.load(merl.rename(tmp_path / "merl.bin"))
    assert type(renamed).__name__ == "MerlBrdf", "content that is recognized goes first"


def test_description(tabulated: Path) -> None:
    facts = utia.load(tabulated).describe()
    assert facts["grid"] == "theta_i x phi_i x theta_v x phi_v: 6 x 48 x 6 x 48"
    assert facts["invalid samples"] == 0.0
    low, high = facts["value range"]
    assert 0.1 < low < high < 1.0


def test_wrong_shapes_are_refused() -> None:
    for shape in ((3, 288, 288), (6, 48, 6, 48, 3), (3, 6, 48, 6, 47)):
        with pytest.raises(ValueError, match="expected shape"):
            UtiaBrdf(np.zeros(shape))


def test_memory_is_bounded(tabulated: Path) -> None:
    tracemalloc.start()
    try:
        brdf = utia.load(tabulated)
        held, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert brdf.describe()["memory bytes"] < 3e6
    assert held < 4e6
    assert peak < 10 * SIZE


# Damaged files


assert_refused = functools.partial(support.assert_refused, utia.load)


def test_file_cut_short_or_too_long_is_refused(tmp_path: Path) -> None:
    data = utia_bytes(random_table())
    path = tmp_path / "cut.bin"
    for length in [*range(1, 20), *range(20, SIZE, 49_999), SIZE - 8, SIZE - 1]:
        assert_refused(write(path, data[:length]), "cut short", str(SIZE))
    for extra in (1, 8, 12, SIZE):
        assert_refused(write(path, data + bytes(extra)), "trailing bytes", str(SIZE))
    assert_refused(write(path, data + bytes(SIZE + 1)), "more than")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("place", [0, 41_472, 288 * 288 * 3 - 1])
def test_value_that_is_not_finite_is_refused(tmp_path: Path, value: float, place: int) -> None:
    table = random_table().astype(float)
    table.flat[place] = value
    assert_refused(write(tmp_path / "bad.bin", utia_bytes(table)), "not finite")


def test_the_largest_values_stay_finite() -> None:
    table = np.full(SHAPE, np.finfo(np.float32).max)
    table[:, 4] = 0.0
    rng = np.random.default_rng(8)
    assert np.isfinite(UtiaBrdf(table).eval(hemisphere(rng, 200), hemisphere(rng, 200))).all()
