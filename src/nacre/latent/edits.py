"""Named directions in the space of codes: rougher, a glossier coat, darker, more metallic.

GGX over a Lambertian base is fitted to every material that a basis was trained on. At the optimum
of such a fit, the derivatives of both sides tell what each of its parameters does when the code
moves a little. A direction does to these parameters what its name says and leaves the others alone,
as closely as one direction can for all materials, in least squares; for colors it has as many
values for each pair of chroma values of the code.

A code adds up logarithms, so a highlight does not widen as such: more of a wide one is mixed in.
The sharpest, with alpha below 0.02, keep their core whatever is added to them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nacre.analytic import Ggx
from nacre.analytic.fitting import fit
from nacre.array import Doubles, Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.latent.basis import LatentBasis
from nacre.latent.directions import shared_directions
from nacre.latent.neural_basis import NeuralBasis, decoded
from nacre.numerics.channels import CHROMA
from nacre.runtime.progress import Progress, silent

STEP = math.log(1.5)
"""Change of the logarithm of alpha, F0 or the diffuse albedo by an amount of 1: half the training
materials change by more."""
COLORING = 0.5
"""Change of colors by an amount of 1, as a fraction of the way there is."""

_GAIN, _SAMPLES, _STARTS = 16.0, 3000, 4  # of fits
_RIDGE = 0.02  # squared length of a direction, beside the mean squared error in deviations
_READING = 10.0  # weight of squared readings of colors, beside the squared errors of the materials
_DARK = 1e-3  # albedo below which it hardly matters how dark a part is
_GRAY = 0.05  # a channel below this fraction of the mean counts as this much
_DIFFERENCE = 1e-4  # of logarithms, for derivatives


class Traits(NamedTuple):
    """Parameters of GGX over a Lambertian base, fitted to a material."""

    roughness: float  # natural logarithm of alpha
    coat: float  # logarithm of the mean of F0 over the channels and a thousandth
    base: float  # the same of the diffuse albedo
    coat_color: Doubles  # chroma components of the logarithm of F0, shape (2,)
    base_color: Doubles  # the same of the diffuse albedo


@dataclass(frozen=True, eq=False)
class Edit:
    """A named direction: the code c moves by an amount times `offset` + `matrix` c."""

    name: str
    opposite: str  # word for amounts below 0, as after "make it"; `name` is that for amounts above
    about: str  # a sentence on what an amount of 1 does
    offset: Doubles  # shape (k,)
    matrix: Doubles  # shape (k, k); 0 where the direction is the same everywhere

    def apply(self, code: Floats, amount: float) -> Doubles:
        """A code (k,) moved by an amount; -2 to 2 are sensible."""
        values = np.asarray(code, np.float64)
        return np.asarray(values + amount * (self.offset + self.matrix @ values), np.float64)


NAMES = "rougher", "glossier coat", "darker", "more saturated", "more metallic"
"""Names of the directions that :func:`edits` finds."""


def traits(brdf: Brdf, samples: int = _SAMPLES) -> Traits:
    """Parameters of GGX over a Lambertian base that come closest to an isotropic material.

    Highlights with alpha below 0.02 take 20,000 samples. Raises NacreError if the material is known
    at hardly any direction.
    """
    return _traits(fit(brdf, Ggx, gain=_GAIN, samples=samples, starts=_STARTS))


def edits(basis: LatentBasis, progress: Progress = silent) -> dict[str, Edit]:
    """The named directions of a neural basis, or of a hypernetwork about one, in the order of
    :data:`NAMES`.

    They are found from the basis's examples, with a fit of less than 0.1 seconds for each. Raises
    NacreError if the basis is of another kind, or keeps codes of fewer than two training materials.
    """
    basis = _neural(basis)
    codes = np.asarray(basis.examples, np.float64)
    if len(codes) < 2:
        raise NacreError("named directions take a basis that keeps the codes of its materials")
    fits = []
    for index, code in enumerate(codes):
        material = basis.decode(code)
        fits.append(fit(material, Ggx, gain=_GAIN, samples=_SAMPLES, starts=_STARTS))
        progress("fitting", index + 1, len(codes), "")
    effects = _effects(basis, codes, fits)
    gray = _gray_directions(effects, basis.luma)
    sizes = np.array([STEP, STEP, -STEP]) / np.median(
        np.einsum("nqk,kq->nq", effects[:, :3], gray), axis=0
    )
    rough, coat, dark = (np.asarray(row, np.float64) for row in (gray * sizes).T)
    k, still = basis.code_dim, np.zeros((basis.code_dim, basis.code_dim))
    colored = still.copy()
    colored[range(basis.luma, k), range(basis.luma, k)] = COLORING
    reading = _base_color_reading(basis, codes, [_traits(x) for x in fits])
    to_coat = np.kron(_coat_color_direction(effects, basis)[:, None], np.eye(2))
    metal = still.copy()
    metal[basis.luma :, basis.luma :] = COLORING * to_coat @ np.kron(reading, np.eye(2))
    words = (
        ("smoother", "The highlight is wider: alpha is 1.5 times as large.", rough, still),
        ("duller coat", "The highlight is 1.5 times as strong; the base stays.", coat, still),
        ("lighter", "The base reflects two thirds as much; the highlight stays.", dark, still),
        ("grayer", "Channels differ 1.5 times as much, in the logarithm.", 0.0 * dark, colored),
        (
            "less metallic",
            "The base reflects two thirds as much; the highlight is 1.5 times as strong, and goes "
            "half the way to the color of the base.",
            coat + dark,
            metal,
        ),
    )
    return {name: Edit(name, *word) for name, word in zip(NAMES, words, strict=True)}


def _neural(basis: LatentBasis) -> NeuralBasis:
    own = getattr(basis, "basis", basis)
    if not isinstance(own, NeuralBasis):
        raise NacreError(f"named directions take a neural basis, got one of kind {basis.kind!r}")
    return own


def _traits(model: Ggx) -> Traits:
    return _named(_free(model))


def _named(free: Doubles) -> Traits:
    """Traits from logarithms of alpha, F0 and the diffuse albedo, shape (7,)."""
    parts = np.exp(free[1:4]), np.exp(free[4:])
    coat, base = (math.log(part.mean() + _DARK) for part in parts)
    return Traits(float(free[0]), coat, base, *map(_color, parts))


def _color(rgb: Doubles) -> Doubles:
    return np.asarray(CHROMA @ np.log(np.maximum(rgb, _GRAY * rgb.mean() + 0.01 * _DARK)))


def _free(model: Ggx) -> Doubles:
    """Logarithms of alpha, F0 and the diffuse albedo of a fit, shape (7,)."""
    values = [np.atleast_1d(model.values[name]) for name in ("roughness", "specular", "diffuse")]
    return np.asarray(np.log(np.maximum(np.concatenate(values), 0.01 * _DARK)), np.float64)


def _effects(basis: NeuralBasis, codes: Doubles, fits: list[Ggx]) -> Doubles:
    """Derivatives of the seven numbers of the traits of materials by their codes, (m, 7, k).

    A fit moves to where the derivatives of its squared errors are 0 again, to first order.
    """
    wi, wo = shared_directions(_SAMPLES, 0)
    light, view = (tuple(np.asarray(c, np.float64) for c in split(w)) for w in (wi, wo))
    cosine = _GAIN * wi[:, 2:].astype(np.float64)
    common, rows = basis.logarithms(wi, wo)

    def logarithms(free: Doubles) -> Doubles:
        alpha, coat, base = np.split(np.exp(free), [1, 4])
        values = {"roughness": float(alpha[0]), "specular": tuple(coat), "diffuse": tuple(base)}
        rgb = Ggx.formula(values, light, view)  # type: ignore[arg-type]
        return np.asarray(np.log1p(cosine * np.stack(rgb, axis=-1))).reshape(-1)

    found = []
    for code, model in zip(codes, fits, strict=True):
        free = _free(model)
        steps = _DIFFERENCE * np.eye(len(free))
        of_fit = np.stack([logarithms(free + s) - logarithms(free - s) for s in steps])
        of_fit /= 2.0 * _DIFFERENCE
        lit = cosine * decoded(common, rows, code)
        of_code = (rows * (lit / (1.0 + lit))).reshape(len(rows), -1)
        ridge = 1e-5 * _SAMPLES * np.eye(len(free))
        moved = np.linalg.solve(of_fit @ of_fit.T + ridge, of_fit @ of_code.T)
        ends = [(np.hstack(_named(free + s)), np.hstack(_named(free - s))) for s in steps]
        of_traits = np.stack([(up - down) / (2.0 * _DIFFERENCE) for up, down in ends], axis=1)
        found.append(of_traits @ moved)
    return np.array(found)


def _weights(effects: Doubles) -> Doubles:
    """Weights (m, q) of effects (m, q, k): those far above the median count little."""
    lengths = np.linalg.norm(effects, axis=2)
    return np.asarray(1.0 / (1.0 + np.square(lengths / np.median(lengths, axis=0))))


def _gray_directions(effects: Doubles, luma: int) -> Doubles:
    """Columns (k, 3) that change roughness, coat and base, each alone, of the luma only."""
    rows = effects[:, :3, :luma]
    weights = _weights(rows)[..., None]
    rows = rows / np.sqrt(np.square(rows).sum(axis=2, keepdims=True).mean(axis=0))
    weighed = rows * weights
    normal = np.einsum("nqi,nqj->ij", weighed, rows) + _RIDGE * len(rows) * np.eye(luma)
    found = np.zeros((effects.shape[2], 3))
    found[:luma] = np.linalg.solve(normal, weighed.sum(axis=0).T)
    return found


def _coat_color_direction(effects: Doubles, basis: NeuralBasis) -> Doubles:
    """Values (p,) for the pairs that change the color of the coat and leave that of the base.

    The effects on colors are, like the pairs, the same for channels in another order: in each block
    of two by two, the effect is the mean of the diagonal.
    """
    blocks = effects[:, 3:, basis.luma :].reshape(len(effects), 2, 2, basis.chroma, 2)
    rows = 0.5 * np.einsum("nqcpc->nqp", blocks)
    weighed = rows * _weights(rows)[..., None]
    normal = np.einsum("nqi,nqj->ij", weighed, rows)
    normal += _RIDGE * len(rows) * np.eye(basis.chroma)
    return np.asarray(np.linalg.solve(normal, weighed[:, 0].sum(axis=0)))


def _base_color_reading(basis: NeuralBasis, codes: Doubles, found: list[Traits]) -> Doubles:
    """Weights (1, p) by which the pairs of a code add up to the color of its base."""
    pairs = codes[:, basis.luma :].reshape(len(codes), basis.chroma, 2)
    rows = pairs.swapaxes(1, 2).reshape(-1, basis.chroma)
    colors = np.array([each.base_color for each in found]).reshape(-1)
    normal = rows.T @ rows + _READING * np.eye(basis.chroma)
    return np.asarray(np.linalg.solve(normal, rows.T @ colors))[None]
