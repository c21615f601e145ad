"""Directions, tensor files and comparisons shared by the tests of measured formats."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chi2

from nacre.brdf import Brdf
from nacre.errors import FormatError, require
from nacre.geometry import split

_CODES = {"u1": 1, "i1": 2, "u2": 3, "i2": 4, "u4": 5, "u8": 7, "i8": 8, "f2": 9, "f4": 10}
_CODES |= {"i4": 6, "f8": 11}

BANDS = np.array([380, 395, 430, 460, 500, 520, 555, 600, 610, 655, 700, 780], np.float32)
"""Wavelengths in nm of made spectral files."""


def hemisphere(rng: np.random.Generator, count: int) -> npt.NDArray[np.float32]:
    """Uniform directions above the horizon, shape (count, 3)."""
    z, phi = 1.0 - rng.random(count), 2.0 * np.pi * rng.random(count)
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1).astype(np.float32)


def tensor_bytes(fields: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """A tensor file holding `fields`."""
    entry = sum(2 + len(name) + 11 + 8 * array.ndim for name, array in fields.items())
    offset = 18 + entry
    header = struct.pack("<12s2BI", b"tensor_file\0", 1, 0, len(fields))
    body = b""
    for name, array in fields.items():
        header += struct.pack("<H", len(name)) + name.encode()
        header += struct.pack("<HBQ", array.ndim, _CODES[array.dtype.str[1:]], offset + len(body))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += array.tobytes()
    return header + body


def material(phi_i: npt.ArrayLike, seed: int = 0, size: int = 12) -> dict[str, npt.NDArray[Any]]:
    """Fields of an RGL material with smooth random tables over the given azimuths.

    With at most two azimuths the tables do not depend on them: the material is isotropic.
    """
    rng = np.random.default_rng(seed)
    phi_i = np.asarray(phi_i, np.float32)
    theta_i = np.linspace(0.0, np.pi / 2.0, 5, dtype=np.float32) ** 1.1
    theta_i *= np.float32(np.pi / 2.0) / theta_i[-1]

    full_turn = bool(phi_i[-1] - phi_i[0] > 6.0)

    def smooth(*shape: int) -> npt.NDArray[np.float32]:
        """Positive, a few nodes a wave along every axis, equal where azimuths meet."""
        total: npt.NDArray[Any] = np.full(shape, 1.6)
        for _ in range(4):
            phase: Any = rng.uniform(0.0, 2.0 * np.pi)
            for axis, count in enumerate(shape):
                step = rng.uniform(0.2, 0.9) * np.arange(count)
                phase = phase + step.reshape([-1 if a == axis else 1 for a in range(len(shape))])
            total = total + 0.35 * np.cos(phase)
        total[..., -1, :] = total[..., 0, :]
        if full_turn and len(shape) > 2:
            total[-1] = total[0]
        return total.astype(np.float32)

    grid = (len(phi_i), len(theta_i))
    fields = {
        "description": np.frombuffer(b"synthetic", np.uint8),
        "phi_i": phi_i,
        "theta_i": theta_i,
        "sigma": smooth(size, size),
        "ndf": smooth(size, size),
        "vndf": smooth(*grid, size, size + 2),
        "luminance": smooth(*grid, size - 3, size - 3),
        "rgb": smooth(*grid, 3, size - 3, size - 3),
        "jacobian": np.ones(1, np.uint8),
    }
    fields["vndf"] *= np.linspace(0.0, 1.0, size + 2, dtype=np.float32)  # no density at the pole
    if len(phi_i) <= 2:
        fields["sigma"][:] = fields["sigma"][0]
        for name in ("vndf", "luminance", "rgb"):
            fields[name][:] = fields[name][0]
    return fields


def spectral(fields: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """The fields of an RGL material with smooth spectra at :data:`BANDS` in place of colors."""
    fields = dict(fields)
    humps = np.exp(-(((BANDS[:, None] - np.array([620.0, 540.0, 450.0])) / 45.0) ** 2))
    spectra = np.einsum("ptcnm,bc->ptbnm", fields.pop("rgb"), humps + 0.02)
    return fields | {"wavelengths": BANDS, "spectra": spectra.astype(np.float32)}


def relative_error(
    ours: npt.NDArray[np.floating], theirs: npt.NDArray[np.floating]
) -> npt.NDArray[np.floating]:
    """|ours - theirs| over the larger of |theirs| and 1 % of the mean of |theirs|."""
    size = np.abs(theirs)
    error: npt.NDArray[np.floating] = np.abs(ours - theirs) / np.maximum(size, 0.01 * size.mean())
    return error


def assert_refused(load: Callable[[Path], Brdf], path: Path, *parts: str) -> None:
    """One line that names the file and says what is wrong."""
    with pytest.raises(FormatError) as caught:
        load(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    for part in parts:
        assert part in message


def assert_same_in_drjit(brdf: Brdf, mi: Any, tolerance: float = 2e-3, share: float = 1.0) -> None:
    """Formulas traced by Dr.Jit give what NumPy gives, to rounding, for a share of the pairs."""
    rng = np.random.default_rng(5)
    wi, wo = hemisphere(rng, 4000), hemisphere(rng, 4000)
    u = rng.random((4000, 3)).astype(np.float32)
    traced = [tuple(mi.Float(np.ascontiguousarray(c)) for c in a.T) for a in (wi, wo, u)]
    values = brdf.eval_components(traced[0], traced[1])
    known = brdf.valid_components(traced[0], traced[1])
    densities = brdf.sampler.pdf_components(traced[0], traced[1])
    drawn, density = brdf.sampler.sample_components(traced[1], traced[2])
    require("drjit", "render").eval(values, known, densities, drawn, density)  # as one kernel
    rgb = np.stack([np.array(c) for c in values], -1)
    error = relative_error(np.stack(brdf.eval_components(split(wi), split(wo)), -1), rgb)
    assert np.quantile(error, share) < tolerance
    valid = np.array(known)
    assert np.mean(valid == brdf.valid_components(split(wi), split(wo))) > 0.999
    pdf = np.array(densities)
    assert relative_error(brdf.pdf(wi, wo), pdf).max() < tolerance
    ours, ours_density = brdf.sample(wo, u)
    distance = np.abs(np.stack([np.array(c) for c in drawn], -1) - ours).max(-1)
    assert np.quantile(distance, 0.999) < 1e-3
    close = (distance < 1e-4) & (ours[:, 2] > 1e-3)
    assert np.quantile(relative_error(ours_density, np.array(density))[close], 0.99) < tolerance


def assert_same_in_torch(brdf: Brdf, tolerance: float = 2e-3, share: float = 1.0) -> None:
    """Formulas on PyTorch tensors give what NumPy gives, to rounding, for a share of the pairs."""
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    rng = np.random.default_rng(6)
    wi, wo = hemisphere(rng, 500), hemisphere(rng, 500)
    tensors = [split_tensor(torch.from_numpy(a)) for a in (wi, wo)]
    rgb = np.stack([c.numpy() for c in brdf.eval_components(*tensors)], -1)
    expected = np.stack(brdf.eval_components(split(wi), split(wo)), -1)
    assert np.quantile(relative_error(expected, rgb), share) < tolerance
    valid = brdf.valid_components(*tensors).numpy()
    assert np.mean(valid == brdf.valid_components(split(wi), split(wo))) > 0.99
    pdf = brdf.sampler.pdf_components(*tensors).numpy()
    assert relative_error(brdf.pdf(wi, wo), pdf).max() < tolerance


def assert_chi_square(brdf: Brdf, tangential: list[float], count: int = 100_000) -> None:
    """Counts of samples in cells of equal solid angle against the integral of the density."""
    rows, columns, fine = 12, 24, 24
    wo = np.array([*tangential, np.sqrt(1.0 - np.dot(tangential, tangential))])
    z, phi = np.meshgrid(
        (np.arange(rows * fine) + 0.5) / (rows * fine),
        (np.arange(columns * fine) + 0.5) / (columns * fine) * 2.0 * np.pi,
        indexing="ij",
    )
    radius = np.sqrt(1.0 - z * z)
    wi = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1)
    density = brdf.pdf(wi, wo).reshape(rows, fine, columns, fine) * 2.0 * np.pi
    expected = density.mean(axis=(1, 3)).ravel() * count / (rows * columns)
    coarse = density[:, 1::3, :, 1::3].mean(axis=(1, 3)).ravel() * count / (rows * columns)
    # Cells near the pole of the half vectors may be too steep to integrate; they join the rest.
    kept = (np.abs(coarse - expected) < 0.01 * expected) & (expected > 20.0)
    assert kept.sum() > 0.6 * rows * columns
    u = np.random.default_rng(2).random((count, 3))
    drawn, pdf = brdf.sample(wo, u)
    up = drawn[:, 2] > 0.0
    assert (pdf[~up] == 0.0).all()
    assert (pdf[up] > 0.0).all()
    row = np.minimum(drawn[up, 2] * rows, rows - 1).astype(int)
    azimuth = np.arctan2(drawn[up, 1], drawn[up, 0]) / (2.0 * np.pi) % 1.0
    column = np.minimum(azimuth * columns, columns - 1).astype(int)
    counts = np.bincount(row * columns + column, minlength=rows * columns)[kept]
    counts, expected = (np.append(c, count - c.sum()) for c in (counts, expected[kept]))
    statistic = np.sum((counts - expected) ** 2 / expected)
    assert statistic < chi2.ppf(1.0 - 1e-4, len(counts) - 1)
    repeated = brdf.pdf(drawn[up], np.broadcast_to(wo, drawn[up].shape))
    np.testing.assert_allclose(repeated, pdf[up], rtol=1e-3, atol=1e-3 * pdf.mean())


def split_tensor(vectors: Any) -> tuple[Any, Any, Any]:
    """Components of a tensor of shape (..., 3)."""
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def write(path: Path, data: bytes) -> Path:
    """Write `data`; returns `path`."""
    path.write_bytes(data)
    return path
