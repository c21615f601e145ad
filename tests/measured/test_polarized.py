"""The first Mueller element of polarized BRDFs, against Mitsuba's `measured_polarized`."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.measured.tensor_file import write_tensors
from tests.variants import require_mitsuba


def write(path: Path, last: float = math.pi, **changes: np.ndarray | None) -> dict[str, np.ndarray]:
    """A file of random values, as the database lays them out."""
    first = -last if last > 3.0 else 0.0
    nodes = {"phi_d": (first, last, 13), "theta_d": (0, 0.5 * math.pi, 7)}
    nodes["theta_h"] = (0, 0.5 * math.pi, 8)
    tensors = {name: np.linspace(*span)[None].astype(np.float32) for name, span in nodes.items()}
    tensors["wvls"] = np.array([450, 500, 550, 600, 650], np.uint16)
    matrices = np.zeros((13, 7, 8, 5, 4, 4), np.float32)
    matrices[..., 0, 0] = np.random.default_rng(0).uniform(0.1, 1.0, matrices.shape[:4])
    matrices[-1] = matrices[0]
    tensors["M"] = matrices
    for name, array in changes.items():
        if array is None:
            del tensors[name]
        else:
            tensors[name] = array
    write_tensors(tensors, path)
    return tensors


def test_values_are_those_of_mitsuba(tmp_path: Path) -> None:
    mi = require_mitsuba("llvm_ad_spectral")
    import drjit as dr

    write(tmp_path / "a.pbsdf")
    material = nacre.load(tmp_path / "a.pbsdf")
    assert "Mueller" in material.notes[0]
    rng = np.random.default_rng(1)
    z, phi = rng.uniform(0.05, 1.0, (2, 300)), rng.uniform(0.0, 2.0 * math.pi, (2, 300))
    r = np.sqrt(1.0 - z * z)
    wi, wo = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).astype(np.float32)
    bsdf = mi.load_dict({"type": "measured_polarized", "filename": str(tmp_path / "a.pbsdf")})
    si = dr.zeros(mi.SurfaceInteraction3f, 300)
    si.wi = mi.Vector3f(*wo.T)
    si.wavelengths = mi.UnpolarizedSpectrum(450, 500, 550, 600)
    found = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*wi.T))).reshape(4, 300) / wi[:, 2]
    np.testing.assert_allclose(material.eval_spectral(wi, wo)[:, :4].T, found, atol=5e-5)


def test_half_a_turn_stands_for_its_mirror_image(tmp_path: Path) -> None:
    write(tmp_path / "half.pbsdf", last=3.0)
    material = nacre.load(tmp_path / "half.pbsdf")
    light = [0.6, 0.0, 0.8]
    views = [[0.3, side * 0.4, math.sqrt(0.75)] for side in (1.0, -1.0)]
    np.testing.assert_allclose(*(material.eval(light, view) for view in views), rtol=1e-5)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wvls": None}, "is missing, found"),
        ({"wvls": np.array([650, 450, 500, 550, 600], np.uint16)}, "'wvls': must be positive"),
        ({"theta_h": np.array([[3.0, 2.0, 1.0]], np.float32)}, "field 'theta_h': must increase"),
        ({"M": np.zeros((2, 2, 2, 5, 4, 4), np.float32)}, "field 'M': has shape"),
        ({"M": np.full((13, 7, 8, 5, 4, 4), np.nan, np.float32)}, "'M': no value is a number"),
    ],
)  # fmt: skip
def test_bad_files_are_refused(tmp_path: Path, changes: dict[str, np.ndarray], words: str) -> None:
    write(tmp_path / "bad.pbsdf", **changes)
    with pytest.raises(FormatError, match=words):
        nacre.load(tmp_path / "bad.pbsdf")
