"""Tables and the picture of :mod:`lab.studies.ablations.haze`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lab.studies.references.hazy_openpbr import HAZE, SPREAD, HazyOpenPbr
from nacre.array import Weights
from nacre.color import tone_map
from nacre.figures.page import Page
from nacre.formats import load_brdf
from nacre.mitsuba.preview import write_bytes
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.standard.openpbr import OpenPbr

Result: TypeAlias = dict[str, Any]
"""What is found about a material: `fits` and `errors` by model, and more."""
Written: TypeAlias = tuple[str, Sequence[str], list[list[str]]]
"""Title, columns and rows of a table."""

KINDS = {
    "vinyl films": ("satin_", "cc_", "cg_", "chm_", "cm_", "vch_"),
    "metallic paints": (
        *("metallic", "silver-paint", "gold-paint", "color-changing", "pearl", "two-layer"),
        "irid_flake",
    ),
    "metals": ("alum", "brass", "chrome", "nickel", "steel", "ss440", "tungsten", "hematite"),
    "plastics": (
        *("plastic", "phenolic", "acrylic-", "-acrylic", "delrin", "nylon", "teflon", "pvc"),
        *("poly", "bball"),
    ),
    "fabrics": ("fabric", "felt", "cloth"),
    "woods": ("oak", "pine", "walnut", "cherry", "fruitwood", "natural", "redwood", "maple"),
    "rubbers": ("rubber", "latex"),
    "paints and papers": ("paint", "paper", "colodur", "cardboard"),
}
"""Parts of names by kind, in order: the first that fits decides."""
SAME = 0.1  # dB, within which solutions explain a material alike

_LIGHTS = (("environment", 0), ("directional", 2))
_SIDE, _GAP, _LINE = 1.5, 0.08, 0.38  # inches


def kind(name: str) -> str:
    """Kind of a material, by its name."""
    return next((kind for kind, words in KINDS.items() if any(w in name for w in words)), "others")


def gain(result: Result, place: int, model: str = "haze") -> float:
    """PSNR in dB under a light that a model has more than the one without haze."""
    errors = result["errors"]
    return float(errors[model][place] - errors["without"][place])


def tables(results: Sequence[Result]) -> list[Written]:
    """All tables."""
    kinds = [*KINDS, "others"]
    groups = {each: [r for r in results if kind(r["name"]) == each] for each in kinds}
    groups = {each: found for each, found in groups.items() if found} | {"all": list(results)}
    by_kind = [[each, str(len(found)), *_summary(found)] for each, found in groups.items()]
    columns = ["kind", "materials"]
    for light, _ in _LIGHTS:
        columns += [f"{light}: mean gain, dB", "> 0.5", "> 1", "two lobes"]
    columns.append("smallest gain of a fit")
    order = sorted(results, key=_mean_gain, reverse=True)
    single = ["material"]
    for light, _ in _LIGHTS:
        single += [f"{light}: without / with / two lobes, dB", "FLIP"]
    single += ["roughness", "haze", "spread"]
    starts = "material", "solutions", f"within {SAME} dB", "roughness", "haze", "spread"
    return [
        ("kinds", columns, by_kind),
        ("materials", single, [_row(each) for each in order]),
        ("starts", starts, [_starts(each) for each in order if each.get("corners")]),
    ]


def _mean_gain(result: Result) -> float:
    return sum(gain(result, place) for _, place in _LIGHTS) / len(_LIGHTS)


def _summary(results: Sequence[Result]) -> list[str]:
    cells = []
    for _, place in _LIGHTS:
        gains = np.array([gain(each, place) for each in results])
        bounds = [gain(r, place, "two lobes") for r in results if "two lobes" in r["errors"]]
        more = f"{np.mean(bounds):+.2f}" if len(bounds) == len(results) else ""
        cells += [f"{gains.mean():+.2f}", str((gains > 0.5).sum()), str((gains > 1.0).sum()), more]
    least = min(r["fits"]["haze"][1] - r["fits"]["without"][1] for r in results)
    return [*cells, f"{least:+.3f}"]


def _row(result: Result) -> list[str]:
    cells = [result["name"]]
    errors = result["errors"].values()
    for _, place in _LIGHTS:
        cells.append(" / ".join(f"{each[place]:.1f}" for each in errors))
        cells.append(" / ".join(f"{each[place + 1]:.3f}" for each in errors))
    values = result["fits"]["haze"][0]
    return cells + [f"{values[name]:.2f}" for name in ("specular_roughness", HAZE, SPREAD)]


def _starts(result: Result) -> list[str]:
    found = [result["fits"]["haze"], *result["corners"]]
    best = max(decibels for _, decibels in found)
    alike = [values for values, decibels in found if decibels > best - SAME]
    names = ("specular_roughness", HAZE, SPREAD)
    ranges = [_range(values[name] for values in alike) for name in names]
    return [result["name"], str(len(found)), str(len(alike)), *ranges]


def _range(numbers: Iterable[float]) -> str:
    given = list(numbers)
    return f"{min(given):.2f} to {max(given):.2f}"


def figure(results: Sequence[Result], path: Path) -> None:
    """Spheres of the three materials that gain most, and of the one that gains least.

    Each is under the light that haze changes more.
    """
    order = sorted(results, key=_mean_gain, reverse=True)
    shown = [*order[:3], *order[3:][-1:]]
    lights = standard_lights(None)
    page = Page((_SIDE + _GAP) * len(shown) + _GAP, (_SIDE + _LINE) * 3 + _GAP, dpi=100)
    for column, result in enumerate(shown):
        name, place = max(_LIGHTS, key=lambda light: abs(gain(result, light[1])))
        fits, errors = result["fits"], result["errors"]
        truth, _ = render_sphere(load_brdf(result["file"]), lights[name])
        pictures: list[tuple[Weights, str]] = [(truth, f"{result['name']}\n{name} light")]
        for kept, model in (("without", OpenPbr), ("haze", HazyOpenPbr)):
            picture, _ = render_sphere(model(**fits[kept][0]), lights[name])
            psnr, flip = errors[kept][place : place + 2]
            title = "with haze" if kept == "haze" else "without haze"
            pictures.append((picture, f"{title}\n{psnr:.1f} dB, {flip:.3f}"))
        for row, (picture, caption) in enumerate(pictures):
            x, y = _GAP + column * (_SIDE + _GAP), _GAP + row * (_SIDE + _LINE)
            page.image(x, y, _SIDE, _SIDE, tone_map(picture))
            page.text(x, y + _SIDE + 0.03, caption, va="top")
    write_bytes(page.pixels(), path)
