"""Edits of textures by directions in the space of their codes: darker, duller, shinier.

Surfaces of the virtual capture are captured as they are and with one property of the surface
changed, on 16 x 16 texels from 31 x 31 directions. From texels before and after, regression on four
training recipes of each family learns what an edit does to a code, or to the coefficients that it
stands for. It is then applied to the recipes that are kept from training and compared with captures
of these that were really changed.

Run `python -m lab.studies.ablations.btf_editing -o OUT`. OUT keeps the
captures; making them takes ten minutes of two cores.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from lab.studies.study import Study, geometric_mean
from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.color import tone_map
from nacre.figures.plot import write_plot
from nacre.formats import load_btf, save
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.domes import Dome
from nacre.textures.capture import capture
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.recipe import Recipe, built_in
from nacre.textures.codecs.basis import BasisCodec
from nacre.textures.codecs.basis.posterior import project
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.codecs.codec_file import PUBLISHED, load_codec

DOME = Dome("coarse", ((0.0, 1, 0.0), (25.0, 6, 0.0), (50.0, 12, 0.0), (70.0, 12, 15.0)))
TEXELS, SAMPLES, CELLS = 16, 64, 128
RECIPES = 4
"""Of each family, for training."""

RIDGE = 1e-3
"""Of regressions, relative to the mean square of what they see."""
CENTERS = 1000
LIGHT, VIEW = (50.0, 90.0), (25.0, 240.0)
"""Polar angles and azimuths in degrees of the pictures."""

Edit = Callable[[Mesostructure], Mesostructure]
Change = Callable[[Floats, Floats, Floats], Floats]
"""From codes or coefficients before and after an edit, and further ones, to these after it."""


def _darker(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, albedo=0.6 * surface.albedo)


def _duller(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, roughness=np.minimum(1.6 * surface.roughness, 1.0))


def _shinier(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, specular=np.minimum(3.0 * surface.specular, 1.0))


EDITS: dict[str, Edit] = {
    "albedo x 0.6": _darker,
    "roughness x 1.6": _duller,
    "specular x 3": _shinier,
}


def recipes() -> list[Recipe]:
    """The first four of each family, and those that are kept from training."""
    return [r for r in built_in() if r.unseen or int(r.name[-2:]) <= RECIPES]


def captured(recipe: Recipe, edit: str, folder: Path) -> TableBtf:
    """A surface as it is where there is no edit, or edited; from the folder if it is there."""
    path = folder / f"{recipe.name} {edit}.npz".replace(" ", "-")
    if not path.exists():
        surface = recipe.build(CELLS)
        if edit:
            surface = EDITS[edit](surface)
        wi, wo = DOME.pairs()
        save(capture(surface, wi, wo, TEXELS, samples=SAMPLES, name=recipe.name), path)
    texture = load_btf(path)
    assert isinstance(texture, TableBtf)
    return texture


@dataclasses.dataclass(frozen=True)
class Pair:
    """Texels of one recipe before and after an edit, and their codes.

    Parameters
    ----------
    recipe
        Of the surface.
    before, after
        Codes, shape (n, values).
    truth
        The texels after the edit, shape (n, pairs, 3).
    """

    recipe: Recipe
    before: Floats
    after: Floats
    truth: Floats


def pairs_of(edit: str, codec: BasisCodec, folder: Path) -> list[Pair]:
    """Every recipe before and after an edit."""
    encode = on_all_cores(codec, codec.encoder(*DOME.pairs()))
    found = []
    for recipe in recipes():
        before, after = (captured(recipe, e, folder).texels(slice(None)) for e in ("", edit))
        found.append(Pair(recipe, encode(before), encode(after), after))
    return found


def constant(known: Floats, changed: Floats, new: Floats) -> Floats:
    """One direction for all: the mean change."""
    result: Floats = new + (changed - known).mean(0)
    return result


def linear(known: Floats, changed: Floats, new: Floats) -> Floats:
    """Changes by ridge regression on what they change, the constant apart."""
    mean, scale = known.mean(0), known.std()
    x, y = (known - mean) / scale, changed - known
    gram = x.T @ x + RIDGE * len(x) * np.eye(x.shape[1], dtype=np.float32)
    slopes = np.linalg.solve(gram, x.T @ (y - y.mean(0)))
    result: Floats = new + y.mean(0) + (new - mean) / scale @ slopes
    return result


def curved(known: Floats, changed: Floats, new: Floats) -> Floats:
    """The linear map, and what it leaves by ridge regression with Gaussians about some texels."""
    some = np.random.default_rng(0).choice(len(known), min(CENTERS, len(known)), replace=False)
    centers = known[some]
    width = np.median(np.linalg.norm(centers[:, None, :] - centers[None, :200], axis=2))

    def features(x: Floats) -> Floats:
        squares = np.square(x).sum(1)[:, None] + np.square(centers).sum(1) - 2.0 * x @ centers.T
        return np.exp(-np.maximum(squares, 0.0) / (2.0 * width**2))

    x, left = features(known), changed - linear(known, changed, known)
    gram = x.T @ x + RIDGE * len(x) * np.eye(len(centers), dtype=np.float32)
    result: Floats = linear(known, changed, new) + features(new) @ np.linalg.solve(gram, x.T @ left)
    return result


def edited(
    codec: BasisCodec, training: list[Pair], new: Floats, change: Change, *, coefficients: bool
) -> Floats:
    """Codes changed as regression on pairs says, found in codes or in coefficients."""
    known, changed = (
        np.concatenate([getattr(p, name) for p in training]) for name in ("before", "after")
    )
    if not coefficients:
        return change(known, changed, new).astype(np.float32)
    wanted = change(codec.decode(known), codec.decode(changed), codec.decode(new))
    wanted = wanted.astype(np.float32)
    return project(codec.encode(wanted), wanted, codec.decode, 2)


METHODS: dict[str, tuple[Change, bool, bool]] = {
    "one direction of codes": (constant, False, False),
    "linear in codes": (linear, False, False),
    "linear in coefficients": (linear, True, False),
    "curved in coefficients": (curved, True, False),
    "linear in coefficients, family unknown": (linear, True, True),
}
"""What is learned, whether of coefficients, and whether without the family that is edited."""


def outcomes(codec: BasisCodec, edit: str, folder: Path) -> Iterator[tuple[str, dict[str, Floats]]]:
    """Name of each unseen recipe, and its codes: as it is, edited in each way, and captured so."""
    pairs = pairs_of(edit, codec, folder)
    for new in (pair for pair in pairs if pair.recipe.unseen):
        found = {"nothing done": new.before}
        for name, (change, coefficients, without) in METHODS.items():
            training = [
                p
                for p in pairs
                if not p.recipe.unseen
                and not (without and p.recipe.generator.name == new.recipe.generator.name)
            ]
            found[name] = edited(codec, training, new.before, change, coefficients=coefficients)
        found["captured, then encoded"] = new.after
        yield new.recipe.name, found


def sheet(
    codec: BasisCodec, rows: dict[str, dict[str, Floats]], truths: dict[str, Floats]
) -> Figure:
    """Pictures of the edit of each texture under a light from the side, brightened alike a row."""
    wi, wo = (from_degrees(*angles).astype(np.float32)[None] for angles in (LIGHT, VIEW))
    decode = on_all_cores(codec, codec.decoder(wi, wo))
    shown = ("nothing done", "linear in coefficients", "curved in coefficients",
             "captured, then encoded")  # fmt: skip
    figure = Figure((1.3 * (len(shown) + 1), 1.3 * len(rows) + 0.4), layout="constrained")
    grid = figure.subplots(len(rows), len(shown) + 1, squeeze=False)
    nearest = int(np.argmin(sum(np.arccos(np.clip(w @ v[0], -1.0, 1.0)) for w, v in
                                zip(DOME.pairs(), (wi, wo), strict=True))))  # fmt: skip
    for axes, (name, codes) in zip(grid, rows.items(), strict=True):
        pictures = [decode(codes[way])[:, 0] for way in shown]
        pictures.append(truths[name][:, nearest])
        exposure = 0.8 / max(float(np.percentile(pictures[0], 98)), 1e-6)
        for ax, picture, way in zip(axes, pictures, (*shown, "captured"), strict=True):
            ax.imshow(tone_map(exposure * picture.reshape(TEXELS, TEXELS, 3)))
            ax.set(xticks=[], yticks=[])
            if name == next(iter(rows)):
                ax.set_title(way.replace(", ", ",\n").replace(" in ", "\nin "), fontsize=7)
        axes[0].set_ylabel(name, fontsize=7)
    return figure


def main() -> None:
    """Print a Markdown table for each edit and write pictures."""
    study = Study(__doc__, __file__)
    study.options()
    codec = load_codec(PUBLISHED)
    assert isinstance(codec, BasisCodec)
    decode = on_all_cores(codec, codec.decoder(*DOME.pairs()))
    for edit in EDITS:
        truths = {
            recipe.name: captured(recipe, edit, study.output).texels(slice(None))
            for recipe in recipes()
            if recipe.unseen
        }
        found = dict(outcomes(codec, edit, study.output))
        table: dict[str, list[float]] = {}
        for name, codes in found.items():
            for way, code in codes.items():
                mse = 1e4 * float(np.square(decode(code) - truths[name]).mean())
                table.setdefault(way, []).append(mse)
        rows = [
            (way, *(f"{mse:.1f}" for mse in (*line, geometric_mean(line))))
            for way, line in table.items()
        ]
        study.table(("MSE x 1e4", *found, "geometric mean"), rows, edit)
        path = study.output / f"{edit.replace(' ', '-')}.png"
        write_plot(sheet(codec, found, truths), path)


if __name__ == "__main__":
    main()
