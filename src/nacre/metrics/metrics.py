"""Numbers that tell how far apart two pictures, or two reflectances, are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles, Floats, Mask
from nacre.brdf import Brdf
from nacre.color import REC_709, rgb_to_xyz_matrix, tone_map
from nacre.errors import NacreError, require
from nacre.geometry import join, uniform_rusinkiewicz
from nacre.metrics.ldr_flip import flip

PAIRS = 100_000  # pairs of directions drawn for angular_errors

# x and y of red, green, blue and white (ITU-R BT.2020)
_REC_2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), (0.3127, 0.3290))
_CONES = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
"""Linear Rec. 2020 RGB to L, M and S (ITU-R BT.2100, table 7)."""
_OPPONENTS = np.array([[2048, 2048, 0], [3305, -6806.5, 3501.5], [17933, -17390, -543]]) / 4096
"""Encoded L, M and S to I, half of C_T, and C_P (ITU-R BT.2124)."""


@dataclass(frozen=True)
class ImageErrors:
    """Errors of a picture after tone mapping to [0, 1], over the covered pixels and channels."""

    mae: float  # mean absolute error
    rmse: float  # root mean square error
    psnr: float  # -20 log10(rmse) in dB; infinite for equal pictures
    ssim: float
    """Structural similarity (Wang et al. 2004) over the frame, color channels averaged; 1 for equal
    pictures."""
    flip: float
    """Mean of the LDR-FLIP map (Andersson et al. 2020); 0 for equal pictures."""


@dataclass(frozen=True)
class AngularErrors:
    """Errors of a reflectance over pairs of directions."""

    count: int  # valid pairs that the figures rest on
    log_cosine: float
    """Mean over pairs and channels of |log(1 + f cos theta_i) - log(1 + g cos theta_i)|, the loss
    of the NBRDF paper (equation 1)."""
    log_cosine_p95: float  # its 95th percentile over pairs, channels averaged
    relative_median: float  # median over pairs and channels of |g - f| / f where f > 0
    rmse_cosine: float  # root mean square of (g - f) cos theta_i in 1/sr: the highlight dominates


def image_errors(
    truth: Floats, other: Floats, mask: Mask | None = None, gamma: float = 2.2
) -> tuple[ImageErrors, Floats]:
    """Errors of a linear picture against a true one after tone mapping, and the FLIP error of every
    pixel in [0, 1], shape (height, width), float32.

    Pictures are linear RGB, shapes (height, width, 3), at least 7 x 7; clipped to [0, 1], then
    raised to 1 / `gamma`. Pixels count where the mask, shape (height, width), is true; all without
    one.

    Raises
    ------
    ValueError
        If the shapes disagree or the mask is empty.
    MissingExtraError
        If scikit-image is not installed.
    """
    if truth.shape != other.shape or truth.ndim != 3 or truth.shape[2] != 3:
        raise ValueError(f"pictures of shapes {truth.shape} and {other.shape} do not compare")
    covered = np.ones(truth.shape[:2], bool) if mask is None else mask
    if covered.shape != truth.shape[:2] or not covered.any():
        raise ValueError(f"the mask {covered.shape} selects nothing of {truth.shape}")
    a, b = tone_map(truth, gamma), tone_map(other, gamma)
    difference = a[covered].astype(np.float64) - b[covered]
    rmse = math.sqrt(np.mean(difference**2))
    metrics, flip_map = require("skimage.metrics", "render"), flip(a, b)
    errors = ImageErrors(
        mae=float(np.mean(np.abs(difference))),
        rmse=rmse,
        psnr=-20.0 * math.log10(rmse) if rmse > 0.0 else math.inf,
        ssim=float(metrics.structural_similarity(a, b, channel_axis=-1, data_range=1.0)),
        flip=float(np.mean(flip_map[covered])),
    )
    return errors, flip_map


def delta_itp(truth: Floats, other: Floats, white: float = 203.0) -> Floats:
    """Color differences Delta E_ITP of two pictures (ITU-R BT.2124), from 0 up: 1 is just visible.

    Among the measures that Kavoosighafi et al. 2025, "Perceived quality of BRDF models", compare
    with how people judge rendered materials, this one follows them best.

    Pictures are linear Rec. 709 RGB, shapes (..., 3), clipped to [0, 1] as displays show them;
    `white` is the luminance of 1 on the display in cd/m^2, by default that of reference white
    (ITU-R BT.2408). The result has shape (...), float64.
    """
    pictures = (np.clip(image, 0.0, 1.0, dtype=np.float64) for image in (truth, other))
    first, second = (_itp(white * picture) for picture in pictures)
    return np.asarray(720.0 * np.linalg.norm(first - second, axis=-1))


def _itp(luminances: Doubles) -> Doubles:
    """I, T and P of linear Rec. 709 RGB in cd/m^2, shape (..., 3) (ITU-R BT.2100 and BT.2124)."""
    to_wide = np.linalg.solve(rgb_to_xyz_matrix(_REC_2020), rgb_to_xyz_matrix(REC_709))
    power = np.maximum(luminances @ (_CONES @ to_wide).T / 10_000.0, 0.0) ** (2610 / 16384)
    encoded = (3424 / 4096 + 2413 / 128 * power) / (1.0 + 2392 / 128 * power)
    return np.asarray(encoded ** (2523 / 32) @ _OPPONENTS.T)


def angular_errors(truth: Brdf, other: Brdf, count: int = PAIRS, seed: int = 0) -> AngularErrors:
    """Errors of a reflectance over pairs of directions uniform in Rusinkiewicz angles.

    Of `count` pairs, which the seed chooses, those below the horizon or without a valid sample in
    `truth` are left out. Raises NacreError if `truth` is valid at none of them.
    """
    generator = np.random.default_rng(seed)
    u = generator.random((4, count), dtype=np.float32)
    wi, wo = map(join, uniform_rusinkiewicz(u))
    valid = truth.valid(wi, wo)
    if not valid.any():
        name = truth.name or "the reference"
        raise NacreError(f"{name}: is known at none of {count} directions, too little to compare")
    wi, wo = wi[valid], wo[valid]
    f, g = truth.eval(wi, wo).astype(np.float64), other.eval(wi, wo).astype(np.float64)
    cosine = wi[:, 2:].astype(np.float64)
    logarithmic = np.abs(np.log1p(f * cosine) - np.log1p(g * cosine))
    positive = f > 0.0
    relative = np.abs(g - f)[positive] / f[positive]
    return AngularErrors(
        count=len(wi),
        log_cosine=float(logarithmic.mean()),
        log_cosine_p95=float(np.percentile(logarithmic.mean(axis=1), 95.0)),
        relative_median=float(np.median(relative)) if positive.any() else 0.0,
        rmse_cosine=float(np.sqrt(np.mean(((g - f) * cosine) ** 2))),
    )
