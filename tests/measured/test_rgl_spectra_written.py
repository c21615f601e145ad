"""Spectral RGL files that are written: in Mitsuba's `measured` and in our reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
from nacre import formats
from nacre.brdf import Brdf
from nacre.measured import rgl
from nacre.measured.rgl_writer import Resolution
from tests.data import require_data
from tests.reflectances import Glossy
from tests.variants import require_mitsuba

from .support import BANDS, hemisphere, material, relative_error, spectral, tensor_bytes, write

SMALL = Resolution(1, 12, 24, 24, 48)


class Spectral(Brdf):
    """A glossy material whose bands differ; its color is not asked for."""

    wavelengths = BANDS.astype(np.float64)

    def eval_components(self, wi, wo):
        return Glossy(0.2, 0.05, 0.3).eval_components(wi, wo)

    def eval_bands(self, wi, wo):
        gray = Glossy(0.2, 0.05, 0.3).eval(wi, wo)[:, :1]
        return gray * (0.2 + 0.01 * np.arange(len(BANDS)))


def pairs(count: int = 4000) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    rng = np.random.default_rng(5)
    wi, wo = hemisphere(rng, count), hemisphere(rng, count)
    seen = np.minimum(wi[:, 2], wo[:, 2]) > 0.1
    return wi[seen], wo[seen]


def color_in_mitsuba(path: Path, wi: npt.NDArray[Any], wo: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """f_r cos of a file as Mitsuba sees it under its D65 with its observer, in linear RGB."""
    mi = require_mitsuba("llvm_ad_spectral")
    import drjit as dr

    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    wavelengths = np.arange(362.0, 830.0, 4.0, dtype=np.float32)[:116]
    at = mi.SurfaceInteraction3f()
    at.wavelengths = mi.Float(wavelengths)
    white = np.array(mi.load_dict({"type": "d65"}).eval(at))[0]
    observer = np.array(mi.cie1931_xyz(mi.Float(wavelengths))) * white
    observer /= observer[1].sum()
    xyz = np.zeros((3, len(wi)))
    for start in range(0, len(wavelengths), 4):
        si.wavelengths = type(si.wavelengths)(*map(float, wavelengths[start : start + 4]))
        values = np.array(bsdf.eval(mi.BSDFContext(), si, light)).reshape(4, -1)
        xyz += observer[:, start : start + 4] @ values
    return np.stack(np.array(mi.xyz_to_srgb(mi.Color3f(xyz))), -1)


def test_mitsuba_sees_the_color_of_a_material_of_colors(tmp_path: Path) -> None:
    brdf = Glossy(0.2, 0.05, 0.3)
    path = tmp_path / "made_spec.bsdf"
    nacre.save(brdf, path, resolution=SMALL)
    wi, wo = pairs()
    found = color_in_mitsuba(path, wi, wo)
    table = rgl.tabulate(brdf, SMALL).eval(wi, wo) * wi[:, 2:]
    assert relative_error(found, table).max() < 5e-3
    assert np.median(relative_error(found, brdf.eval(wi, wo) * wi[:, 2:])) < 0.01


def test_a_file_of_colors_gains_spectra_and_keeps_the_rest(tmp_path: Path) -> None:
    source = nacre.load(require_data("rgl", "satin_rosaline_rgb.bsdf"))
    nacre.save(source, tmp_path / "satin_spec.bsdf")
    again = nacre.load(tmp_path / "satin_spec.bsdf")
    np.testing.assert_array_equal(again.tables.vndf, source.tables.vndf)
    np.testing.assert_array_equal(again.tables.luminance, source.tables.luminance)
    largest = np.abs(source.tables.rgb).max(axis=2, keepdims=True)
    assert (np.abs(again.tables.rgb - source.tables.rgb) <= 2e-3 * largest).all()
    wi, wo = pairs(500)
    np.testing.assert_allclose(again.eval(wi, wo), source.eval(wi, wo), rtol=0.01, atol=1e-4)
    assert again.wavelengths[[0, -1]].tolist() == [360.0, 830.0]


def test_spectra_are_tabulated_band_by_band(tmp_path: Path) -> None:
    nacre.save(Spectral(), tmp_path / "x_spec.bsdf", resolution=SMALL)
    found = nacre.load(tmp_path / "x_spec.bsdf")
    np.testing.assert_array_equal(found.wavelengths, BANDS)
    wi, wo = pairs()
    expected = Spectral().eval_spectral(wi, wo)
    values = found.eval_spectral(wi, wo)
    assert np.median(relative_error(values, expected)) < 5e-3
    np.testing.assert_allclose(values[:, 5] / values[:, 0], 0.25 / 0.2, rtol=1e-4)


def test_bands_are_kept_by_name_whatever_the_resolution(tmp_path: Path) -> None:
    source = write(tmp_path / "made_spec.bsdf", tensor_bytes(spectral(material([0.0]))))
    brdf = nacre.load(source)
    nacre.save(brdf, tmp_path / "again_spec.bsdf", resolution=SMALL)
    np.testing.assert_array_equal(nacre.load(tmp_path / "again_spec.bsdf").wavelengths, BANDS)
    for name, anew, lost in (
        ("x_spec.bsdf", True, False),
        ("x_spec.bsdf", False, False),
        ("x.bsdf", True, True),
        ("x.bsdf", False, False),
        ("x.csv", False, False),
        ("x.mbsdf", False, True),
    ):
        assert formats.loses_bands(brdf, tmp_path / name, anew) is lost
