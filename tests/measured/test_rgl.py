"""The RGL reader against Mitsuba's `measured`, against itself, and against damaged files."""

from __future__ import annotations

import functools
import itertools
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from nacre.brdf import above_horizon
from nacre.errors import FormatError
from nacre.geometry import join, split
from nacre.measured import rgl
from nacre.measured.axis import bisect
from nacre.measured.tensor_file import read_tensors
from tests.measured import support
from tests.variants import require_mitsuba

from ..data import list_data, require_data
from .support import (
    assert_same_in_drjit,
    assert_same_in_torch,
    hemisphere,
    material,
    relative_error,
    tensor_bytes,
    write,
)

PAIRS = 100_000
REAL = list_data("rgl", "*.bsdf") or ["satin_rosaline_rgb.bsdf"]
AZIMUTHS = {
    "isotropic": [0.0],
    "isotropic, two azimuths": [-1.0, 1.0],
    "full turn": np.linspace(-np.pi, np.pi, 16),
    "half a turn": np.linspace(-np.pi, 0.0, 8),
    "quarter turn": np.linspace(-np.pi, -np.pi / 2.0, 9),
}


@pytest.fixture(params=list(AZIMUTHS))
def synthetic(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A file with smooth random tables, for every symmetry."""
    return write(tmp_path / "made_rgb.bsdf", tensor_bytes(material(AZIMUTHS[request.param])))


def assert_matches_mitsuba(path: Path) -> None:
    mi = require_mitsuba()
    import drjit as dr

    rng = np.random.default_rng(1)
    wi, wo = hemisphere(rng, PAIRS), hemisphere(rng, PAIRS)
    u = rng.random((PAIRS, 3)).astype(np.float32)
    theirs = mi.load_dict({"type": "measured", "filename": str(path)})
    si = dr.zeros(mi.SurfaceInteraction3f, PAIRS)
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    context = mi.BSDFContext()
    ours = rgl.load(path)

    reflected, density = theirs.eval_pdf(context, si, light)
    drawn, _ = theirs.sample(context, si, mi.Float(u[:, 0]), mi.Point2f(u[:, 1], u[:, 2]))
    dr.eval(reflected, density, drawn)  # as one kernel
    value = np.array(reflected).T
    error = relative_error(ours.eval(wi, wo) * wi[:, 2:], np.maximum(value, 0.0))
    assert error.max() < 1e-3
    assert np.quantile(error, 0.999) < 2e-4

    signed = np.stack(ours.eval_components(split(wi), split(wo)), -1) * wi[:, 2:]
    assert relative_error(signed, value).max() < 1e-3, "raw values keep Mitsuba's signs"

    error = relative_error(ours.pdf(wi, wo), np.array(density))
    assert error.max() < 1e-3
    assert np.quantile(error, 0.999) < 3e-4

    direction, pdf = ours.sample(wo, u)
    distance = np.abs(direction - np.array(drawn.wo).T).max(-1)
    assert np.quantile(distance, 0.999) < 5e-4
    above = (direction[:, 2] > 1e-3) & (distance < 1e-4)
    assert np.quantile(relative_error(pdf, np.array(drawn.pdf))[above], 0.999) < 1e-3


@pytest.mark.parametrize("name", REAL)
def test_real_material_matches_mitsuba(name: str) -> None:
    assert_matches_mitsuba(require_data("rgl", name))


def test_every_symmetry_matches_mitsuba(synthetic: Path) -> None:
    assert_matches_mitsuba(synthetic)


def test_table_without_jacobian_matches_mitsuba(tmp_path: Path) -> None:
    fields = material([0.0]) | {"jacobian": np.zeros(1, np.uint8)}
    assert_matches_mitsuba(write(tmp_path / "made_rgb.bsdf", tensor_bytes(fields)))


def test_array_libraries_agree(synthetic: Path) -> None:
    assert_same_in_drjit(rgl.load(synthetic), require_mitsuba())
    assert_same_in_torch(rgl.load(synthetic))


def test_array_libraries_agree_on_a_real_material() -> None:
    brdf = rgl.load(require_data("rgl", "satin_rosaline_rgb.bsdf"))
    assert_same_in_drjit(brdf, require_mitsuba())
    assert_same_in_torch(brdf)


def test_turned_directions_are_equal_where_symmetric(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    wi, wo = hemisphere(rng, 2000), hemisphere(rng, 2000)
    half_turn, mirror = np.array([-1.0, -1.0, 1.0]), np.array([1.0, -1.0, 1.0])
    for name, factors in (("half a turn", [half_turn]), ("quarter turn", [half_turn, mirror])):
        path = write(tmp_path / "made.bsdf", tensor_bytes(material(AZIMUTHS[name])))
        brdf = rgl.load(path)
        assert not brdf.isotropic
        for factor in factors:
            turned = brdf.eval(wi * factor, wo * factor)
            np.testing.assert_allclose(turned, brdf.eval(wi, wo), rtol=1e-3)


def test_axis_directions_are_evaluated(synthetic: Path) -> None:
    """On the axes azimuths meet the ends of the tables, and half vectors the pole."""
    brdf = rgl.load(synthetic)
    axes = [[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.0, -0.6, 0.8], [0.0, 0.0, 1.0]]
    axes.append([-0.6, -0.0, 0.8])
    wi, wo = (np.array(v) for v in zip(*itertools.product(axes, axes), strict=True))
    assert np.isfinite(brdf.eval(wi, wo)).all()
    assert (brdf.eval(wi, wo) > 0.0).all()
    assert np.isfinite(brdf.pdf(wi, wo)).all()
    below = wi * [1.0, 1.0, -1.0]
    assert (brdf.eval(below, wo) == 0.0).all()
    assert (brdf.pdf(wo, below) == 0.0).all()


def test_directions_that_are_not_numbers_do_not_raise(synthetic: Path) -> None:
    brdf = rgl.load(synthetic)
    up, nowhere = split(np.array([[0.0, 0.0, 1.0]])), split(np.full((1, 3), np.nan))
    for wi, wo in ((up, nowhere), (nowhere, up)):
        with np.errstate(invalid="ignore"):
            values = brdf.eval_components(wi, wo)
        assert (join(above_horizon(values, wi, wo)) == 0.0).all()


def test_zero_uniforms_give_a_density() -> None:
    brdf = rgl.load(require_data("rgl", "cg_sunflower_rgb.bsdf"))
    wi, pdf = brdf.sample([0.0, 0.6, 0.8], np.zeros(3))
    assert np.isfinite(wi).all()
    assert np.isfinite(pdf)


@pytest.mark.parametrize("name", REAL)
def test_real_material_is_known_above_the_horizon(name: str) -> None:
    """Missing tabulated points lie below the horizon; a color out of gamut is not missing."""
    brdf = rgl.load(require_data("rgl", name))
    wi, wo = (hemisphere(np.random.default_rng(seed), 20_000) for seed in (8, 9))
    assert brdf.valid(wi, wo).mean() > 0.99
    facts = brdf.describe()
    assert facts["isotropic"] is True
    assert facts["name"] == brdf.name
    assert "theta_i x phi_i: 8 x 1; vndf 128 x 128" in facts["grid"]
    assert 0.0 < facts["points below the horizon"] < 0.12


def test_out_of_gamut_colors_clamp_only_in_eval() -> None:
    brdf = rgl.load(require_data("rgl", "cg_sunflower_rgb.bsdf"))
    wi, wo = (hemisphere(np.random.default_rng(seed), 20_000) for seed in (8, 9))
    raw = np.stack(brdf.eval_components(split(wi), split(wo)), -1)
    assert (raw[:, 2] < 0.0).mean() > 0.5
    assert (brdf.eval(wi, wo) >= 0.0).all()
    assert brdf.describe()["points with a negative channel"] > 0.7


def test_row_without_density_gives_zero(tmp_path: Path) -> None:
    fields = material([0.0])
    fields["vndf"][:, :, 3:6] = 0.0
    brdf = rgl.load(write(tmp_path / "made.bsdf", tensor_bytes(fields)))
    wi, wo = (hemisphere(np.random.default_rng(seed), 5000) for seed in (8, 9))
    assert np.isfinite(brdf.eval(wi, wo)).all()
    assert np.isfinite(brdf.pdf(wi, wo)).all()
    _, pdf = brdf.sample(wo, np.random.default_rng(4).random((5000, 3)))
    assert np.isfinite(pdf).all()


def test_bisection_finds_the_last_smaller_entry() -> None:
    rng = np.random.default_rng(7)
    for count in (1, 2, 3, 7, 8, 31, 127):
        entries = np.sort(rng.integers(0, 40, count)).astype(float)
        values = rng.integers(-2, 43, 200).astype(float)
        found = bisect(
            lambda i, entries=entries: entries[i], values, np.zeros(200, np.int64), count
        )
        expected = np.maximum(np.searchsorted(entries, values, side="left") - 1, 0)
        np.testing.assert_array_equal(found, expected)


def test_name_falls_back_to_the_file(tmp_path: Path) -> None:
    fields = material([0.0])
    path = write(tmp_path / "made_rgb.bsdf", tensor_bytes(fields))
    assert rgl.load(path).name == "synthetic"
    fields["description"] = np.frombuffer(b" \0", np.uint8)
    assert rgl.load(write(path, tensor_bytes(fields))).name == "made_rgb"


def test_format_is_recognized() -> None:
    assert rgl.FORMAT.recognize(tensor_bytes(material([0.0]))[:64])
    assert not rgl.FORMAT.recognize(b"tensor")


# Damaged files


assert_refused = functools.partial(support.assert_refused, rgl.load)


def test_what_is_not_a_tensor_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.bsdf"
    assert_refused(path, "no such file")
    assert_refused(tmp_path, "is a directory")
    assert_refused(write(path, b""), "is empty")
    assert_refused(write(path, b"<html>not found</html>"), "not an RGL material")
    good = tensor_bytes(material([0.0]))
    assert_refused(write(path, good[:12] + b"\2\0" + good[14:]), "version 2.0")
    for count in (0, 2**31 - 1, 2**32 - 1):
        assert_refused(write(path, good[:14] + struct.pack("<I", count) + good[18:]), "fields")


@pytest.mark.parametrize("size", [0, 2**31 - 1, 2**32, 2**63, 2**64 - 1])
@pytest.mark.parametrize("axis", range(5))
def test_absurd_size_is_refused_before_allocating(tmp_path: Path, size: int, axis: int) -> None:
    data = tensor_bytes(material([0.0]))
    at = data.index(b"\3\0rgb") + 5 + 11 + 8 * axis
    damaged = data[:at] + struct.pack("<Q", size) + data[at + 8 :]
    assert_refused(write(tmp_path / "absurd.bsdf", damaged), "field 'rgb'")


def test_absurd_offset_type_and_rank_are_refused(tmp_path: Path) -> None:
    data = tensor_bytes(material([0.0]))
    at = data.index(b"\3\0rgb") + 5
    path = tmp_path / "absurd.bsdf"
    for offset in (len(data), 2**63, 2**64 - 1):
        damaged = data[: at + 3] + struct.pack("<Q", offset) + data[at + 11 :]
        assert_refused(write(path, damaged), "field 'rgb'", "past the end")
    for code in (0, 12, 255):
        assert_refused(write(path, data[: at + 2] + bytes([code]) + data[at + 3 :]), "type code")
    damaged = data[:at] + struct.pack("<H", 65535) + data[at + 2 :]
    assert_refused(write(path, damaged), "dimensions")


def test_repeated_field_is_refused(tmp_path: Path) -> None:
    data = tensor_bytes(material([0.0])).replace(b"\3\0ndf", b"\3\0rgb")
    assert_refused(write(tmp_path / "twice.bsdf", data), "field 'rgb'", "twice")


@pytest.mark.parametrize("name", list(material([0.0])))
def test_missing_field_is_named(tmp_path: Path, name: str) -> None:
    fields = material([0.0])
    del fields[name]
    path = write(tmp_path / "missing.bsdf", tensor_bytes(fields))
    assert_refused(path, f"field '{name}'", "is missing")


Spoil = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]


def _with(value: float) -> Spoil:
    def spoil(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        array = array.copy()
        array.flat[array.size // 2] = value
        return array

    return spoil


def _zero_slice(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array = array.copy()
    array[0, 2] = 0.0
    return array


FLOATS = ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "rgb")
SPOILS: list[tuple[str, str, Spoil]] = [
    *((name, "finite", _with(v)) for name in FLOATS for v in (np.nan, np.inf)),
    *((name, "negative", _with(-1.0)) for name in ("ndf", "sigma", "vndf", "luminance")),
    *((name, "float64", lambda a: a.astype(np.float64)) for name in FLOATS),
    *((name, "shape", lambda a: a[..., :1]) for name in FLOATS[2:]),
    *((name, "shape", lambda a: a[None]) for name in FLOATS),
    *((name, "zero throughout", _zero_slice) for name in ("vndf", "luminance")),
    ("theta_i", "increase", lambda a: a[::-1]),
    ("theta_i", "increase", lambda a: 0.0 * a),
    ("theta_i", "radians", lambda a: a * np.float32(180.0 / np.pi)),
    ("phi_i", "radians", lambda a: a + np.float32(90.0)),
    ("luminance", "shape", lambda a: a[:, 1:]),
    ("rgb", "shape", lambda a: a[:, :, :2]),
    ("jacobian", "0 or 1", lambda a: a + np.uint8(1)),
    ("jacobian", "0 or 1", lambda a: np.zeros(2, np.uint8)),
    ("description", "text", lambda a: a.astype(np.uint32)),
]


@pytest.mark.parametrize(("name", "complaint", "spoil"), SPOILS)
def test_bad_field_is_named(tmp_path: Path, name: str, complaint: str, spoil: Spoil) -> None:
    fields = material([0.0])
    fields[name] = np.ascontiguousarray(spoil(fields[name]))
    path = write(tmp_path / "bad.bsdf", tensor_bytes(fields))
    assert_refused(path, f"field '{name}'", complaint)


def test_azimuths_over_a_third_of_a_turn_are_refused(tmp_path: Path) -> None:
    fields = material(np.linspace(-np.pi, -np.pi / 3.0, 8))
    path = write(tmp_path / "third.bsdf", tensor_bytes(fields))
    assert_refused(path, "field 'phi_i'", "must span")


def test_names_of_fields_have_a_bound(tmp_path):
    fine, long = ("n" * count for count in (256, 257))
    one = np.ones(1, np.float32)
    assert list(read_tensors(write(tmp_path / "a.bsdf", tensor_bytes({fine: one})))) == [fine]
    with pytest.raises(FormatError, match=r"the name of field \d has 257 characters"):
        read_tensors(write(tmp_path / "a.bsdf", tensor_bytes({long: one})))
