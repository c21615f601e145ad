"""The sheet of `nacre compare`: both spheres under both lights, and their differences."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats, Image
from nacre.brdf import Brdf
from nacre.figures.difference_sheet import Row, difference_sheet
from nacre.figures.page import Bytes, scale_end, scale_note
from nacre.metrics.comparison import Comparison, LightComparison
from nacre.metrics.ldr_flip import displayed_flip
from nacre.mitsuba.lights import Light
from nacre.mitsuba.sphere import smooth_edges

_NAMES = {"environment": "Environment", "directional": "Directional light, 45°"}


def picture(comparison: Comparison, views: tuple[Floats, Floats] | None = None) -> Bytes:
    """Draw a comparison as sRGB bytes, shape (height, width, 3).

    Rows are lights; columns are the reference, the model, and the FLIP error map. If the model is
    known from few samples, another row shows how dark and how bright it may be. Pictures are tone
    mapped as for the metrics. Shadows are drawn with smooth edges, which do not affect any number
    or map.

    Parameters
    ----------
    views
        Square linear renderings of both materials in one scene, for another row.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    rows = []
    for item in comparison.lights:
        truth, other = (
            _smooth(image, brdf, item.source)
            for image, brdf in zip((item.truth, item.other), comparison.materials, strict=True)
        )
        label = _NAMES.get(item.light, item.light)
        rows.append(Row(truth, other, item.flip_map, label, _figures(item), sphere=True))
    if views is not None:
        errors = displayed_flip(*views)
        rows.append(Row(*views, errors, "Path traced", f"FLIP {errors.mean():.4f}", smooth=True))
    if (known := comparison.plausible) is not None:
        note = f"from | to, of 90 %; {known.inside:.0%} of the reference inside"
        rows.append(Row(known.low, known.high, known.flip_map, "Plausible", note, sphere=True))
    scale = flip_scale(comparison)
    angles = comparison.angles
    notes = (
        f"Over {angles.count:,} pairs of directions: log-cosine error {angles.log_cosine:.4f}, "
        f"median relative error {angles.relative_median:.1%}",
        f"FLIP error from 0 (equal) to 1; {scale_note(scale)}",
        str(comparison.verdict),
    )
    names = comparison.truth, comparison.other
    return difference_sheet(rows, scale, "Difference (FLIP)", names, notes)


def flip_scale(comparison: Comparison) -> float:
    """The FLIP error at the bright end of the sheet's color scale."""
    maps = [item.flip_map[comparison.mask] for item in comparison.lights]
    if (known := comparison.plausible) is not None:
        maps.append(known.flip_map[comparison.mask])
    return scale_end(maps)


def _smooth(image: Image, brdf: Brdf, light: Light) -> Image:
    """A sphere whose shadow has a smooth edge; only light from one direction casts one."""
    if light.count > 1:  # the page cuts out the rim smoothly
        return image
    smooth, coverage = smooth_edges(image, brdf, light)
    covered: Image = np.where(coverage > 0.0, coverage, np.float32(1.0))
    return smooth / covered[..., None]


def _figures(item: LightComparison) -> str:
    errors = item.errors
    psnr = "infinite" if math.isinf(errors.psnr) else f"{errors.psnr:.1f} dB"
    return f"SSIM {errors.ssim:.4f}     PSNR {psnr}     FLIP {errors.flip:.4f}"
