"""Plots of f_r over wavelength at pairs of directions, with materials on top of each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError, printable
from nacre.figures.page import FAINT, INK, RULE, Page
from nacre.figures.plot import INCIDENCE, check_count, draw_key, key_places, line_style
from nacre.geometry import from_spherical, join

_PANEL, _LEFT, _GAP, _TITLE = (2.3, 1.5), 0.5, 0.42, 0.3  # inches
_FOOTER = 0.5
_FEW = 12  # bands whose values are marked


def spectrum_figure(
    materials: Mapping[str, Brdf],
    incidence: Sequence[float] = INCIDENCE,
    *,
    azimuth: float = 0.0,
) -> Any:
    """Draw f_r over wavelength, with a column of panels for each angle of incidence.

    The upper row has the mirror direction, the lower one the viewer at the normal, where an angle
    of 45 degrees is the geometry of colorimeters. A panel has no line of a material that is not
    known there. The first of several materials is a wide gray line below the others.

    Parameters
    ----------
    materials
        Reflectances with spectra by the names to show, at most
        :data:`nacre.figures.plot.MAX_MATERIALS`.
    incidence
        Polar angles of the light in radians, in [0, pi/2).
    azimuth
        Of the plane of incidence, toward the mirror direction, in radians.

    Returns
    -------
    matplotlib.figure.Figure
        For :func:`nacre.figures.plot.write_plot`.

    Raises
    ------
    NacreError
        If there is no material or too many, one is known in RGB only, or nothing is known at these
        directions.
    ValueError
        If there is no angle of incidence.
    MissingExtraError
        If Matplotlib is not installed.
    """
    if not incidence:
        raise ValueError("expected at least one angle of incidence")
    check_count(len(materials))
    bands = {name: _bands(name, brdf) for name, brdf in materials.items()}
    rows = {
        "mirror direction": [(angle, angle) for angle in incidence],
        "viewer at the normal": [(angle, 0.0) for angle in incidence],
    }
    pairs = [pair for row in rows.values() for pair in row]
    spectra = {name: _spectra(brdf, pairs, azimuth) for name, brdf in materials.items()}
    if not any(np.isfinite(values).any() for values in spectra.values()):
        raise NacreError("nothing to plot: f_r is not known at any of these directions")

    step = _PANEL[0] + _GAP
    width = _LEFT + len(incidence) * step
    places, top = key_places(list(materials), width - _LEFT)
    down = _TITLE + _PANEL[1] + 0.15
    page = Page(width, top + len(rows) * down + _FOOTER, "white")
    for index, pair in enumerate(pairs):
        j, i = divmod(index, len(incidence))
        left, y = _LEFT + i * step, top + j * down + _TITLE
        title = f"light {math.degrees(pair[0]):g}°, {list(rows)[j]}"
        page.text(left, y - 0.08, title, 9.0, INK)
        axes = _framed(page.axes(left, y, *_PANEL), last=j + 1 == len(rows))
        highest = 0.0
        for k, (name, x) in enumerate(bands.items()):
            values, style = spectra[name][index], line_style(k, len(bands))
            mark = {"marker": "o", "markersize": 3} if len(x) <= _FEW else {}
            axes.plot(x, values, zorder=2, **style, **mark)
            highest = max(highest, float(np.nan_to_num(values).max()))
        axes.set_xlim(*_ends(bands))
        axes.set_ylim(0.0, 1.08 * highest or 1.0)
        if not any(np.isfinite(values[index]).any() for values in spectra.values()):
            middle = {"transform": axes.transAxes, "ha": "center", "va": "center"}
            axes.text(0.5, 0.5, "not measured here", color=FAINT, fontsize=8, **middle)
    draw_key(page, places)
    plane = f"; plane at azimuth {math.degrees(azimuth):g}°" if azimuth else ""
    note = f"f_r in 1/sr over wavelength in nm{plane}"
    page.text(_LEFT, page.height - 0.14, note, 8.0, FAINT, va="bottom")
    return page.figure


def _bands(name: str, brdf: Brdf) -> Floats:
    """Wavelengths in nm, shape (bands,)."""
    if brdf.wavelengths is None:
        raise NacreError(f"{printable(name)}: is known in RGB only, and has no spectrum to plot")
    return brdf.wavelengths


def _spectra(brdf: Brdf, pairs: Sequence[tuple[float, float]], azimuth: float) -> Floats:
    """f_r in every band, shape (pairs, bands), for polar angles of light and viewer; NaN where
    unknown.
    """
    theta_i, theta_o = np.array(pairs, np.float64).T
    wi = join(from_spherical(theta_i, np.full(len(pairs), azimuth + math.pi)))
    wo = join(from_spherical(theta_o, np.full(len(pairs), azimuth)))
    known = np.asarray(brdf.valid(wi, wo))[:, None]
    return np.where(known, np.asarray(brdf.eval_spectral(wi, wo), np.float64), math.nan)


def _ends(bands: Mapping[str, Floats]) -> tuple[float, float]:
    """The span in nm of all materials; some width around a single band."""
    every = np.concatenate(list(bands.values()))
    low, high = float(every.min()), float(every.max())
    return (low, high) if high > low else (low - 10.0, high + 10.0)


def _framed(axes: Any, *, last: bool) -> Any:
    """Axes with a line at the left and below, small numbers, and faint lines across."""
    axes.set_axis_on()
    axes.patch.set_visible(False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(RULE)
    axes.tick_params(labelsize=8, labelcolor=FAINT, color=RULE, labelbottom=last)
    axes.locator_params(nbins=5)
    axes.grid(axis="y", color=RULE, linewidth=0.6, zorder=0)
    axes.set_axisbelow(True)
    return axes
