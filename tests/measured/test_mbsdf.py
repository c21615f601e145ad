"""The MDL reader and writer: against SciPy's interpolation, the format's own files and damage."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import nacre
from nacre import formats
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join, to_spherical
from nacre.measured import MbsdfBrdf, mbsdf
from nacre.measured.mbsdf_table import Resolution
from nacre.metrics.physics import albedo
from tests.data import require_data
from tests.reflectances import Beckmann
from tests.specimens.tables import mbsdf_block, mbsdf_file
from tests.variants import require_mitsuba

from .support import assert_same_in_drjit, assert_same_in_torch, write

SCALAR = "test_reflection_scalar_theta_2_phi_3"


def random_table(theta: int = 5, phi: int = 7, channels: int = 3) -> MbsdfBrdf:
    values = np.random.default_rng(0).random((theta, theta, phi, channels), dtype=np.float32)
    return MbsdfBrdf(values)


def test_values_are_linear_between_the_centers_of_cells_and_constant_beyond() -> None:
    brdf = random_table()
    theta, phi = (np.arange(5) + 0.5) / 5 * math.pi / 2, (np.arange(7) + 0.5) / 7 * math.pi
    expected = RegularGridInterpolator((theta, theta, phi), brdf.stored.astype(np.float64))
    u = np.random.default_rng(1).random((4, 500))
    angles = [u[0] * math.pi / 2, u[1] * math.pi / 2, u[2] * math.pi]
    inside = [np.clip(a, n[0], n[-1]) for a, n in zip(angles, (theta, theta, phi), strict=True)]
    turn = 2.0 * math.pi * u[3]
    for side in (-1.0, 1.0):
        wi = join(from_spherical(angles[0], turn))
        wo = join(from_spherical(angles[1], turn + side * angles[2]))
        np.testing.assert_allclose(brdf.eval(wi, wo), expected(np.stack(inside, -1)), rtol=1e-9)


def test_the_light_is_the_slowest_axis_and_the_mirror_direction_comes_last() -> None:
    values = np.zeros((9, 9, 18, 3))
    values[2, 6, 17] = 1.0
    brdf = MbsdfBrdf(values)
    low, high = (join(from_spherical((i + 0.5) / 9 * math.pi / 2, 0.0)) for i in (2, 6))
    opposite = high * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(brdf.eval(low, opposite), 1.0)
    assert not brdf.eval(opposite, low).any()
    assert not brdf.eval(low, high).any()


def test_torch_evaluates_the_same() -> None:
    assert_same_in_torch(random_table())


def test_drjit_evaluates_the_same() -> None:
    assert_same_in_drjit(random_table(), require_mitsuba())


@pytest.mark.parametrize("color", ["red", "blue"])
def test_the_sample_files_come_back_byte_for_byte(color: str, tmp_path: Path) -> None:
    source = require_data("mbsdf", f"carpaint_{color}.mbsdf")
    brdf = nacre.load(source)
    nacre.save(brdf, tmp_path / "x.mbsdf")
    assert (tmp_path / "x.mbsdf").read_bytes() == source.read_bytes()
    mirror = join(from_spherical([math.radians(45.0), math.radians(45.0)], [0.0, math.pi]))
    beside = join(from_spherical(math.radians(45.0), math.pi / 2))
    highlight = brdf.eval(mirror[0], mirror[1]).mean()
    assert highlight > 10.0 * brdf.eval(mirror[0], beside).mean() > 0.0


def test_scalar_files_are_gray_and_stay_scalar(tmp_path: Path) -> None:
    source = require_data("mbsdf", f"{SCALAR}.mbsdf")
    brdf = nacre.load(source)
    light, view = (join(from_spherical(math.radians(a), 0.0)) for a in (67.5, 22.5))
    view = view * [-1.0, 1.0, 1.0]
    # The format's own file counts up from 0, the azimuth fastest and the light slowest.
    np.testing.assert_array_equal(brdf.eval(light, view), [8.0] * 3)
    nacre.save(brdf, tmp_path / "x.mbsdf")
    assert (tmp_path / "x.mbsdf").read_bytes() == source.read_bytes()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("transmission_scalar_theta_2_phi_4", "holds transmission; nacre reads reflection only"),
        (f"{SCALAR[5:]}_transmission_scalar_theta_2_phi_4", "transmission beside reflection"),
        ("none", "holds no values"),
        ("file_format_error", "is of no known format"),
    ],
)
def test_what_is_not_reflectance_alone_is_refused_by_name(name: str, message: str) -> None:
    path = require_data("mbsdf", f"test_{name}.mbsdf")
    with pytest.raises(FormatError, match=message) as caught:
        nacre.load(path)
    assert str(path) in str(caught.value)


VALUES = np.ones((2, 2, 3, 3))
BLOCK = b"NVIDIA ARC MBSDF V1\nMBSDF_DATA=\n"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (mbsdf_file()[:-1], "ends within the values of a grid of \\(2, 2, 3\\)"),
        (mbsdf_file() + b"\0", "trailing bytes"),
        (mbsdf_file(value=math.nan), "not finite"),
        (mbsdf_file(text=b"a\tb\n"), "line 2: is not printable"),
        (mbsdf_file(text=b"x" * (1 << 17)), "holds no values"),
        (BLOCK, "ends within the header"),
        (BLOCK + mbsdf_block(2, 2, 3, VALUES), "type of the values: 2, expected 0 or 1"),
        (BLOCK + mbsdf_block(1, 0, 3, VALUES), "header gives 0 polar angles"),
        (BLOCK + mbsdf_block(1, 1024, 1024, VALUES), "ends within the values"),
        (BLOCK + mbsdf_block(1, 2**32 - 1, 1, VALUES), "expected 1 to 1024"),
    ],
)
def test_damage_is_named(data: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=message):
        mbsdf.load(write(tmp_path / "x.mbsdf", data))


def test_lines_of_text_are_kept(tmp_path: Path) -> None:
    data = mbsdf_file(text=b'description="paint"\nby="a \\"b\\""\n')
    brdf = mbsdf.load(write(tmp_path / "x.mbsdf", data))
    assert brdf.remarks == ('description="paint"', 'by="a \\"b\\""')
    nacre.save(brdf, tmp_path / "y.mbsdf")
    assert (tmp_path / "y.mbsdf").read_bytes() == data


class Linear(Brdf):
    """What the grid can hold between the centers of its cells."""

    def eval_components(self, wi, wo):
        (a, _), (b, _) = to_spherical(wi), to_spherical(wo)
        return 1.0 + a, 1.0 + a * b, 2.0 - 0.5 * b


class PartlyKnown(Linear):
    """Not known where the light is lower than 61 degrees."""

    def valid_components(self, wi, wo):
        return wi[2] > math.cos(math.radians(61.0)) + 0.0 * wo[2]


def test_a_reflectance_that_the_grid_can_hold_is_found_again() -> None:
    brdf, table = Linear(), mbsdf.tabulate(Linear(), Resolution(24, 6))
    theta = np.radians(np.arange(5.0, 86.0, 5.0))
    wi = join(from_spherical(theta[:, None], 0.0 * theta))
    wo = join(from_spherical(theta, 0.0 * theta + 1.0))
    np.testing.assert_allclose(table.eval(wi, wo), brdf.eval(wi, wo), rtol=5e-3)


def test_what_is_not_known_does_not_darken_what_is_near() -> None:
    table = mbsdf.tabulate(PartlyKnown(), Resolution(18, 6))  # nodes 5 degrees apart
    near, far, view = (join(from_spherical(math.radians(a), 0.0)) for a in (60.0, 88.0, 20.0))
    np.testing.assert_allclose(table.eval(near, view), Linear().eval(near, view), rtol=0.02)
    assert not table.eval(far, view).any()


def test_a_highlight_narrower_than_a_cell_keeps_its_energy() -> None:
    sharp, views = Beckmann(0.0, 0.5, 0.03), np.radians([20.0, 33.0, 47.0, 61.0])
    truth = albedo(sharp, views, count=1 << 12).value
    table = mbsdf.tabulate(sharp, Resolution(24, 48))
    found = albedo(table, views, count=1 << 12).value
    np.testing.assert_allclose(found, truth, rtol=0.03)


def test_only_isotropic_materials_and_sizes_that_fit_are_written(tmp_path: Path) -> None:
    path = tmp_path / "x.mbsdf"
    with pytest.raises(FormatError, match="isotropic"):
        mbsdf.save(Beckmann(0.1, 0.4, 0.1, 0.3), path)
    for resolution, message in (((0, 6), "1 to 1024"), ((1024, 1024), "more than"), ((9,), "phi")):
        with pytest.raises(FormatError, match=message):
            formats.writer(path, resolution)
    assert not list(tmp_path.iterdir())


def test_a_black_material_stays_black() -> None:
    assert not mbsdf.tabulate(MbsdfBrdf(np.zeros((2, 2, 2, 3))), Resolution(3, 3)).stored.any()


def test_what_begins_otherwise_is_refused_by_the_reader_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.mbsdf"
    mbsdf.save(random_table(), path)
    assert path.read_bytes().startswith(b"NVIDIA ARC MBSDF V1\n")
    path.write_bytes(path.read_bytes().replace(b"V1", b"V2", 1))
    with pytest.raises(FormatError, match="does not begin with the line NVIDIA ARC MBSDF V1"):
        mbsdf.load(path)


@pytest.mark.parametrize("text", [b"\x07ab\n", b"a\x07b\n", b"ab\x07\n"])
def test_no_line_of_text_has_control_characters(tmp_path: Path, text: bytes) -> None:
    with pytest.raises(FormatError, match="line 2: is not printable"):
        nacre.load(write(tmp_path / "a.mbsdf", mbsdf_file(text=text)))
