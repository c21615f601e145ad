"""The MERL reader and writer against the database's own lookup, and against damaged files."""

from __future__ import annotations

import functools
import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.geometry import from_rusinkiewicz_angles, half_difference, isotropic, join, split
from nacre.geometry import rusinkiewicz_angles as angles
from nacre.measured import MerlBrdf, merl, merl_array
from nacre.measured.merl_table import SCALES
from tests.measured import support
from tests.variants import require_mitsuba

from .support import assert_same_in_drjit, assert_same_in_torch, hemisphere, write

SMALL = (9, 8, 10)
DATABASE = (90, 90, 180)


@dataclass
class Glossy(Brdf):
    """A smooth reciprocal lobe over a colored base; a stand-in for a measurement."""

    name: str = "glossy"
    isotropic: bool = True
    blind: float = 0.0
    """Directions to the light lower than this (cosine) are not known."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        h, d = half_difference(wi, wo)
        lobe = isotropic(h)[2] ** 20 * (1.0 - 0.3 * d[2])
        return 0.3 + lobe, 0.2 + 0.8 * lobe, 0.1 + 0.5 * lobe

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return (wi[2] > self.blind) & (wo[2] > 0.0)


def random_table(seed: int = 0, invalid: float = 0.0) -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    table = rng.random((3, *SMALL), dtype=np.float32)
    table[:, rng.random(SMALL) < invalid] = -1.0
    return table


def merl_bytes(table: npt.NDArray[Any]) -> bytes:
    return struct.pack("<3i", *table.shape[1:]) + table.astype("<f8").tobytes()


@pytest.fixture(scope="module")
def tabulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of the database's size."""
    path = tmp_path_factory.mktemp("merl") / "glossy.binary"
    merl.save(Glossy(), path)
    return path


def reference_lookup(
    table: npt.NDArray[np.floating], wi: npt.NDArray[np.floating], wo: npt.NDArray[np.floating]
) -> tuple[float, float, float]:
    """One value the way the database's documentation has it: with trigonometry and truncation."""
    counts = table.shape[1:]
    half = (wi + wo) / np.linalg.norm(wi + wo)
    theta_h, phi_h = math.acos(half[2]), math.atan2(half[1], half[0])
    c, s = math.cos(-phi_h), math.sin(-phi_h)
    x, y, z = c * wi[0] - s * wi[1], s * wi[0] + c * wi[1], wi[2]
    c, s = math.cos(-theta_h), math.sin(-theta_h)
    x, z = c * x + s * z, c * z - s * x
    theta_d, phi_d = math.acos(min(z, 1.0)), math.atan2(y, x)
    if phi_d < 0.0:
        phi_d += math.pi
    degrees = theta_h / (math.pi / 2.0) * counts[0]
    i = min(int(math.sqrt(degrees * counts[0])), counts[0] - 1)
    j = min(int(theta_d / (math.pi * 0.5) * counts[1]), counts[1] - 1)
    k = min(int(phi_d / math.pi * counts[2]), counts[2] - 1)
    red, green, blue = (float(v * s) for v, s in zip(table[:, i, j, k], SCALES, strict=True))
    return red, green, blue


def test_nearest_is_the_lookup_of_the_database() -> None:
    table = random_table()
    brdf = MerlBrdf(table, interpolation="nearest")
    rng = np.random.default_rng(1)
    wi, wo = (hemisphere(rng, 3000).astype(float) for _ in range(2))
    expected = [reference_lookup(table, a, b) for a, b in zip(wi, wo, strict=True)]
    np.testing.assert_allclose(brdf.eval(wi, wo), expected, rtol=1e-5)


def node_directions(
    counts: tuple[int, ...], nudge: float = 0.0
) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]]:
    """Directions (wi, wo) of every node, shape (*counts, 3)."""
    i, j, k = np.meshgrid(*(np.arange(n) + nudge for n in counts), indexing="ij")
    theta_h = (i / counts[0]) ** 2 * (np.pi / 2.0)
    theta_d = j / counts[1] * (np.pi / 2.0)
    pair = from_rusinkiewicz_angles(theta_h, 0.0 * theta_h, theta_d, k / counts[2] * np.pi)
    return join(pair[0]), join(pair[1])


def test_nodes_stand_where_documented() -> None:
    table = random_table()
    expected = np.moveaxis(table, 0, -1) * SCALES
    for interpolation, nudge in (("trilinear", 0.0), ("nearest", 1e-6)):
        wi, wo = node_directions(SMALL, nudge)
        visible = (wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6)
        visible[:, 0] = False  # the azimuth of d is free where theta_d is 0
        brdf = MerlBrdf(table, interpolation=interpolation)
        values = brdf.eval(wi, wo)
        np.testing.assert_allclose(values[visible], expected[visible], rtol=1e-5, atol=1e-9)


def test_trilinear_is_linear_between_nodes_and_periodic_in_phi_d() -> None:
    i, j, k = np.meshgrid(*(np.arange(n) for n in SMALL), indexing="ij")
    wave = np.cos(2.0 * np.pi * k / SMALL[2])
    brdf = MerlBrdf(np.stack([3.0 + i, 2.0 + 0.5 * j, 2.0 + wave]))
    rng = np.random.default_rng(2)
    wi, wo = (hemisphere(rng, 4000).astype(float) for _ in range(2))
    theta_h, _, theta_d, phi_d = angles(split(wi), split(wo))
    at_h = np.minimum(np.sqrt(theta_h * 2.0 / np.pi) * SMALL[0], SMALL[0] - 1)
    at_d = np.minimum(theta_d * 2.0 / np.pi * SMALL[1], SMALL[1] - 1)
    at_p = phi_d % np.pi / np.pi * SMALL[2]
    whole = np.floor(at_p)
    mix = (1.0 - at_p + whole) * np.cos(2.0 * np.pi * whole / SMALL[2])
    mix += (at_p - whole) * np.cos(2.0 * np.pi * (whole + 1.0) / SMALL[2])
    expected = np.stack([3.0 + at_h, 2.0 + 0.5 * at_d, 2.0 + mix], -1) * SCALES
    np.testing.assert_allclose(brdf.eval(wi, wo), expected, rtol=1e-5)


@pytest.mark.parametrize("interpolation", ["trilinear", "nearest"])
def test_exchanging_directions_changes_nothing(interpolation: merl.Interpolation) -> None:
    brdf = MerlBrdf(random_table(invalid=0.1), interpolation=interpolation)
    rng = np.random.default_rng(3)
    wi, wo = (hemisphere(rng, 2000).astype(float) for _ in range(2))
    np.testing.assert_allclose(brdf.eval(wi, wo), brdf.eval(wo, wi), rtol=2e-5)


def test_invalid_nodes_do_not_pollute_the_others() -> None:
    table = np.ones((3, *SMALL))
    table[:, 3:5, 2:4, 4:6] = -5.0
    table[1, 6, 6, 0] = -1.0  # one negative channel makes the sample invalid
    brdf = MerlBrdf(table)
    assert brdf.mask.sum() == np.prod(SMALL) - 9
    rng = np.random.default_rng(4)
    wi, wo = hemisphere(rng, 20_000), hemisphere(rng, 20_000)
    values, valid = brdf.eval(wi, wo), brdf.valid(wi, wo)
    known = values[:, 0] > 0.0
    np.testing.assert_allclose(values[known] / SCALES, 1.0, rtol=1e-5)
    assert valid[known].mean() > 0.8
    assert not valid[~known].any()
    assert (~valid & known).any(), "cells with some invalid nodes are evaluated but not valid"
    nearest = MerlBrdf(table, interpolation="nearest")
    np.testing.assert_array_equal(nearest.valid(wi, wo), nearest.eval(wi, wo)[:, 0] > 0.0)


def test_valid_at_a_valid_node_beside_an_invalid_one() -> None:
    table = np.ones((3, *SMALL))
    table[:, 3, 3, 4] = -1.0
    brdf = MerlBrdf(table)
    wi, wo = node_directions(SMALL)
    assert not brdf.valid(wi[3, 3, 4:5], wo[3, 3, 4:5]).any()
    assert brdf.valid(wi[3, 3, 5:6], wo[3, 3, 5:6]).all()
    assert brdf.valid(wi[2, 3, 4:5], wo[2, 3, 4:5]).all()


@pytest.mark.parametrize("interpolation", ["trilinear", "nearest"])
def test_array_libraries_agree(interpolation: merl.Interpolation) -> None:
    brdf = MerlBrdf(random_table(), interpolation=interpolation)
    share = 1.0 if interpolation == "trilinear" else 0.99  # rounding may move to the next node
    assert_same_in_drjit(brdf, require_mitsuba(), share=share)
    assert_same_in_torch(brdf, share=share)


def test_directions_outside_the_table_do_not_raise() -> None:
    for interpolation in ("trilinear", "nearest"):
        brdf = MerlBrdf(random_table(), interpolation=interpolation)
        up = np.array([[0.0, 0.0, 1.0]])
        for other in ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0]):
            assert (brdf.eval(up, other) == 0.0).all()
            assert (brdf.eval(other, up) == 0.0).all()
            assert not brdf.valid(up, other).any()


# Tabulating and files


def test_tabulated_material_is_close_to_its_source(tabulated: Path) -> None:
    brdf = merl.load(tabulated)
    rng = np.random.default_rng(5)
    wi, wo = hemisphere(rng, 20_000), hemisphere(rng, 20_000)
    inside = (wi[:, 2] > 0.1) & (wo[:, 2] > 0.1)
    assert brdf.valid(wi[inside], wo[inside]).mean() > 0.999
    np.testing.assert_allclose(
        brdf.eval(wi[inside], wo[inside]), Glossy().eval(wi[inside], wo[inside]), rtol=2e-3
    )


def test_nodes_at_and_below_the_horizon_are_invalid() -> None:
    brdf = merl.tabulate(Glossy())
    wi, wo = node_directions(DATABASE)
    lowest = np.minimum(wi[..., 2], wo[..., 2])
    np.testing.assert_array_equal(brdf.mask, lowest > 1e-6)
    assert (np.abs(lowest) < 1e-12).any(), "some nodes lie exactly at the horizon"
    assert (brdf.stored[:, ~brdf.mask] == merl.INVALID).all()


def test_what_the_source_does_not_know_stays_unknown() -> None:
    brdf = merl.tabulate(Glossy(blind=0.3))
    wi, wo = node_directions(DATABASE)
    expected = (wi[..., 2] > 0.3) & (wo[..., 2] > 1e-6)
    edge = np.abs(wi[..., 2] - 0.3) < 1e-9
    np.testing.assert_array_equal(brdf.mask[~edge], expected[~edge])


def test_saved_file_comes_back_byte_for_byte(tabulated: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.binary"
    merl.save(merl.load(tabulated), again)
    assert again.read_bytes() == tabulated.read_bytes()
    assert tabulated.stat().st_size == 12 + 3 * 8 * 90 * 90 * 180


def test_table_of_another_size_keeps_values_and_mask(tmp_path: Path) -> None:
    table = random_table(invalid=0.2).astype(float)
    table[0, 0, 0, 0] = -0.123
    brdf = merl.load(write(tmp_path / "small.binary", merl_bytes(table)))
    assert brdf.dimensions == SMALL
    assert brdf.name == "small"
    np.testing.assert_array_equal(brdf.stored, table.astype(np.float32))
    merl.save(brdf, tmp_path / "again.binary")
    again = merl.load(tmp_path / "again.binary")
    np.testing.assert_array_equal(again.stored, brdf.stored)
    np.testing.assert_array_equal(again.mask, brdf.mask)


def test_anisotropic_material_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "brushed.binary"
    with pytest.raises(FormatError, match="brushed: MERL holds isotropic reflectance only"):
        merl.save(Glossy(name="brushed", isotropic=False), path)
    assert not path.exists()


def test_writing_into_an_absent_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="does not exist; create it first"):
        merl.save(MerlBrdf(random_table()), tmp_path / "absent" / "a.binary")


def test_description(tabulated: Path) -> None:
    facts = merl.load(tabulated).describe()
    assert facts["name"] == "glossy"
    assert facts["grid"] == "theta_h x theta_d x phi_d: 90 x 90 x 180"
    assert 0.2 < facts["invalid samples"] < 0.6
    low, high = facts["value range"]
    assert 0.09 < low < high < 1.4
    assert MerlBrdf(np.full((3, *SMALL), -1.0)).describe()["value range"] is None


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        MerlBrdf(np.zeros((90, 90, 180)))
    with pytest.raises(ValueError, match="interpolation"):
        MerlBrdf(random_table(), interpolation="cubic")  # type: ignore[arg-type]


def test_format_is_recognized(tabulated: Path) -> None:
    with tabulated.open("rb") as file:
        assert merl.FORMAT.recognize(file.read(64))
    assert not merl.FORMAT.recognize(b"")
    assert not merl.FORMAT.recognize(b"tensor_file\0\1\0")


# Damaged files


assert_refused = functools.partial(support.assert_refused, merl.load)


def test_a_full_turn_of_phi_d_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "turn.binary", struct.pack("<3i", 90, 90, 360) + bytes(100))
    assert_refused(path, "360 nodes in phi_d")


def test_file_cut_short_or_too_long_is_refused(tmp_path: Path) -> None:
    data = merl_bytes(random_table())
    path = tmp_path / "cut.binary"
    for offset in [*range(1, 40), *range(40, len(data), 331), len(data) - 8, len(data) - 1]:
        assert_refused(write(path, data[:offset]), "cut short")
    assert_refused(write(path, data + b"\0"), "trailing bytes")


@pytest.mark.parametrize("size", [0, -1, -(2**31), 2**31 - 1, 1025])
@pytest.mark.parametrize("axis", range(3))
def test_absurd_dimension_is_refused(tmp_path: Path, size: int, axis: int) -> None:
    data = merl_bytes(random_table())
    damaged = data[: 4 * axis] + struct.pack("<i", size) + data[4 * axis + 4 :]
    assert_refused(write(tmp_path / "absurd.binary", damaged), "header gives", str(size))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_value_that_is_not_finite_is_refused(tmp_path: Path, value: float) -> None:
    table = random_table().astype(float)
    table[1, 2, 3, 4] = value
    assert_refused(write(tmp_path / "bad.binary", merl_bytes(table)), "not finite")


# Values of less precision


@pytest.mark.parametrize("kind", ["<f4", "<f2"])
def test_reduced_precision_is_told_by_the_length(tmp_path: Path, kind: str) -> None:
    table = 100.0 * random_table(invalid=0.1)
    header = struct.pack("<3i", *SMALL)
    path = write(tmp_path / "x.binary", header + table.astype(kind).tobytes())
    brdf = merl.load(path)
    np.testing.assert_array_equal(brdf.stored, table.astype(kind).astype(np.float32))
    whole = merl.load(write(path, merl_bytes(table.astype(kind))))
    np.testing.assert_array_equal(brdf.stored, whole.stored)
    path = tmp_path / "again.binary"
    merl.save(brdf, path)
    assert path.stat().st_size == 12 + 24 * math.prod(SMALL), "written with float64 as ever"


@pytest.mark.parametrize("kind", ["<f4", "<f2"])
def test_other_lengths_and_infinities_of_reduced_precision_are_refused(
    tmp_path: Path, kind: str
) -> None:
    data = struct.pack("<3i", *SMALL) + random_table().astype(kind).tobytes()
    path = tmp_path / "x.binary"
    for length in (len(data) - 1, len(data) + 1, len(data) - 2, len(data) + 4):
        refused = data[:length] + bytes(max(0, length - len(data)))
        assert_refused(write(path, refused), "cut short", "17292 or 8652 or 4332")
    infinite = data[:-4] + np.array([np.inf] * 2, kind).tobytes()[-4:]
    words = ["not finite"] + ["float16 ends at 65504"] * (kind == "<f2")
    assert_refused(write(path, infinite), *words)


# Resolution


def test_a_table_is_tabulated_at_a_resolution(tmp_path: Path) -> None:
    nodes = merl.Resolution(24, 18, 12)
    merl.save(Glossy(), tmp_path / "x.binary", nodes)
    brdf = merl.load(tmp_path / "x.binary")
    assert brdf.dimensions == (24, 18, 12)
    wi, wo = node_directions((24, 18, 12))
    up = (wi[..., 2] > 0.01) & (wo[..., 2] > 0.01)
    np.testing.assert_allclose(brdf.eval(wi[up], wo[up]), Glossy().eval(wi[up], wo[up]), rtol=2e-3)
    merl_array.save_npz(brdf, tmp_path / "y.npz", merl.Resolution(6, 5, 4))
    assert merl_array.load_npz(tmp_path / "y.npz").dimensions == (6, 5, 4)


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ((0, 90, 180), "1 to 1024"),
        ((90, 90, 1025), "1 to 1024"),
        ((-1, 90, 180), "1 to 1024"),
        ((1024, 1024, 1024), "more than"),
        ((90, 90, 360), "half a turn"),
    ],
)
def test_resolutions_that_cannot_be_read_are_refused(nodes: tuple[int, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        merl.Resolution(*nodes)
