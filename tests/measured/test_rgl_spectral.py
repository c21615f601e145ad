"""Spectral RGL files against Mitsuba's `measured`, and files with damaged spectra."""

from __future__ import annotations

import functools
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.measured import rgl
from nacre.measured.tensor_file import read_tensors
from nacre.spectra import to_rgb
from tests.data import require_data
from tests.measured import support
from tests.measured.support import (
    BANDS,
    hemisphere,
    material,
    relative_error,
    spectral,
    tensor_bytes,
    write,
)
from tests.variants import require_mitsuba

FULL_TURN = np.linspace(-np.pi, np.pi, 9)
QUARTER = np.linspace(-np.pi, -np.pi / 2.0, 5)
assert_refused = functools.partial(support.assert_refused, rgl.load)


def made(tmp_path: Path, **changes: npt.NDArray[Any]) -> Path:
    fields = spectral(material([0.0])) | changes
    return write(tmp_path / "made_spec.bsdf", tensor_bytes(fields))


def assert_matches_mitsuba(path: Path, count: int = 20_000) -> None:
    mi = require_mitsuba("llvm_ad_spectral")
    import drjit as dr

    rng = np.random.default_rng(1)
    wi, wo = hemisphere(rng, count), hemisphere(rng, count)
    ours, theirs = rgl.load(path), mi.load_dict({"type": "measured", "filename": str(path)})
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    between = (BANDS + np.append(BANDS[1:], BANDS[-1])) / 2.0
    wavelengths = np.concatenate([BANDS, between.astype(np.float32)])
    columns = []
    for four in wavelengths.reshape(-1, 4):
        # Opaque numbers leave all to one kernel.
        si.wavelengths = type(si.wavelengths)(*(dr.opaque(mi.Float, float(x)) for x in four))
        columns.append(np.array(theirs.eval(mi.BSDFContext(), si, light)).T)
    value = np.maximum(np.concatenate(columns, axis=1), 0.0)

    bands = ours.eval_spectral(wi, wo)
    assert bands.shape == (count, len(BANDS))
    assert bands.dtype == np.float32
    linear = np.stack([np.interp(wavelengths, BANDS, row) for row in bands])
    error = relative_error(linear * wi[:, 2:], value)
    assert error.max() < 1e-3
    assert np.quantile(error, 0.999) < 2e-4


@pytest.mark.parametrize("phi_i", [[0.0], FULL_TURN, QUARTER], ids=["one", "turn", "quarter"])
def test_bands_match_mitsuba_for_every_symmetry(
    tmp_path: Path, phi_i: npt.NDArray[np.floating]
) -> None:
    fields = spectral(material(phi_i))
    square = fields["spectra"].shape[3:]
    assert square[0] == square[1], "Mitsuba reads no other"
    assert_matches_mitsuba(write(tmp_path / "made_spec.bsdf", tensor_bytes(fields)))


def test_bands_without_jacobian_match_mitsuba(tmp_path: Path) -> None:
    assert_matches_mitsuba(made(tmp_path, jacobian=np.zeros(1, np.uint8)))


def test_spectra_of_a_real_material_match_mitsuba(tmp_path: Path) -> None:
    fields = read_tensors(require_data("rgl", "satin_rosaline_rgb.bsdf"))
    assert_matches_mitsuba(write(tmp_path / "satin_spec.bsdf", tensor_bytes(spectral(fields))))


def test_color_is_that_of_the_spectra(tmp_path: Path) -> None:
    brdf = nacre.load(made(tmp_path))
    rng = np.random.default_rng(2)
    wi, wo = hemisphere(rng, 2000), hemisphere(rng, 2000)
    expected = to_rgb(brdf.eval_bands(wi, wo), BANDS)
    raw = np.stack(brdf.eval_components(split(wi), split(wo)), -1)
    assert relative_error(raw, expected).max() < 1e-5
    assert (brdf.eval_spectral(wi * [1, 1, -1], wo) == 0.0).all()
    assert brdf.eval_spectral(wi[:3, None], wo[None, :2]).shape == (3, 2, len(BANDS))
    facts = brdf.describe()
    assert facts["bands"] == len(BANDS)
    assert facts["wavelengths nm"] == [380.0, 780.0]


def test_a_spectral_file_is_written_as_it_stands(tmp_path: Path) -> None:
    path = made(tmp_path, extra=np.arange(3, dtype=np.uint32))
    nacre.save(nacre.load(path), tmp_path / "again.bsdf")
    before, after = read_tensors(path), read_tensors(tmp_path / "again.bsdf")
    assert before.keys() == after.keys()
    for name, array in before.items():
        np.testing.assert_array_equal(after[name], array)
    nacre.save(nacre.load(tmp_path / "again.bsdf"), tmp_path / "third.bsdf")
    assert (tmp_path / "third.bsdf").read_bytes() == (tmp_path / "again.bsdf").read_bytes()


def test_what_has_no_spectra_says_so(tmp_path: Path) -> None:
    brdf = rgl.load(write(tmp_path / "made_rgb.bsdf", tensor_bytes(material([0.0]))))
    assert brdf.wavelengths is None
    with pytest.raises(NacreError, match="RGB only"):
        brdf.eval_spectral([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])


def _with(array: npt.NDArray[Any], value: float) -> npt.NDArray[Any]:
    array = array.copy()
    array.flat[array.size // 2] = value
    return array


SPECTRA = spectral(material([0.0]))["spectra"]


@pytest.mark.parametrize(
    ("field", "value", "complaint"),
    [
        ("wavelengths", BANDS[::-1].copy(), "must increase"),
        ("wavelengths", np.full_like(BANDS, 500.0), "must increase"),
        ("wavelengths", BANDS * np.float32(1e-3), "must increase and be nm"),
        ("wavelengths", BANDS - np.float32(300.0), "be nm"),
        ("wavelengths", _with(BANDS, np.nan), "not finite"),
        ("wavelengths", BANDS.astype(np.float64), "float64"),
        ("wavelengths", BANDS[None], "expected one list"),
        ("spectra", SPECTRA[:, :, :-1], "has shape"),
        ("spectra", SPECTRA[..., :1], "has shape"),
        ("spectra", _with(SPECTRA, np.nan), "not finite"),
        ("spectra", _with(SPECTRA, np.inf), "not finite"),
    ],
)
def test_bad_spectra_are_named(
    tmp_path: Path, field: str, value: npt.NDArray[Any], complaint: str
) -> None:
    path = made(tmp_path, **{field: np.ascontiguousarray(value)})
    assert_refused(path, f"field '{field}'", complaint)


@pytest.mark.parametrize("name", ["wavelengths", "spectra"])
def test_missing_spectral_field_is_named(tmp_path: Path, name: str) -> None:
    fields = spectral(material([0.0]))
    del fields[name]
    path = write(tmp_path / "made_spec.bsdf", tensor_bytes(fields))
    assert_refused(path, f"field '{name}'", "is missing")


def test_a_file_cut_short_is_refused(tmp_path: Path) -> None:
    data = made(tmp_path).read_bytes()
    for length in (*range(1, 500, 7), *range(500, len(data), len(data) // 20)):
        assert_refused(write(tmp_path / "cut.bsdf", data[:length]))


def test_colors_that_overflow_are_clamped(tmp_path: Path) -> None:
    spectra = np.full_like(spectral(material([0.0]))["spectra"], 3.4e38)
    brdf = rgl.load(made(tmp_path, spectra=spectra))
    rng = np.random.default_rng(3)
    assert np.isfinite(brdf.eval(hemisphere(rng, 99), hemisphere(rng, 99))).all()


def test_many_bands_take_no_more_memory_than_the_file(tmp_path: Path) -> None:
    count = 4096
    fields = material([0.0], size=5)
    fields["wavelengths"] = np.linspace(360.0, 800.0, count, dtype=np.float32)
    fields["spectra"] = np.ones((*fields.pop("rgb").shape[:2], count, 2, 2), np.float32)
    path = write(tmp_path / "x_spec.bsdf", tensor_bytes(fields))
    to_rgb(np.ones(2), [400.0, 700.0])  # the observer is read once
    tracemalloc.start()
    try:
        brdf = rgl.load(path)
        assert tracemalloc.get_traced_memory()[1] < 8 * path.stat().st_size
    finally:
        tracemalloc.stop()
    flat = brdf.tables.rgb
    np.testing.assert_allclose(flat, np.ones_like(flat), rtol=1e-3)
