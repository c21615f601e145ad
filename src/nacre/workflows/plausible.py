"""Materials that could be: drawn from what a basis was trained on, or brought back to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError
from nacre.figures.code_views import coded
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.kinds import members
from nacre.latent.prior import Prior
from nacre.metrics import albedo
from nacre.runtime.progress import Progress, silent

VIEWS = 0.0, 0.8, 1.3
"""Polar angles of views in radians, at which what is drawn must not reflect more than arrives."""
_DRAWN, _ROUNDS = 64, 40  # codes drawn at a time, and how often, before nothing fits
_POINTS = 256  # of an albedo


@dataclass(frozen=True)
class Plausibility:
    """How plausible a material is.

    Parameters
    ----------
    log_density
        Natural logarithm of the density of its code.
    typical
        Fraction of the training materials that are less plausible, each without itself, in [0, 1].
    albedo
        Its largest albedo, of three views and all channels; above 1 it makes light.
    """

    log_density: float
    typical: float
    albedo: float


def plausibility(material: CodedBrdf) -> Plausibility:
    """How plausible a material of a basis is.

    Raises
    ------
    NacreError
        If the basis does not know what materials are like.
    """
    prior = known_prior(material.basis)
    log_density = float(prior.log_density(material.code))
    typical = float((prior.left_out() < log_density).mean())
    return Plausibility(log_density, typical, largest_albedo(material))


def known_prior(basis: LatentBasis) -> Prior:
    """The density of codes of a basis.

    Raises
    ------
    NacreError
        If the basis has none, or it is of fewer than two materials.
    """
    if len(basis.prior.orders) < 2:
        raise NacreError("the basis was trained on too few materials to say what is plausible")
    return basis.prior


def largest_albedo(material: CodedBrdf) -> float:
    """The largest of a material at :data:`VIEWS`, of all channels."""
    return float(albedo(material, VIEWS, count=_POINTS).value.max())


def draw_materials(
    basis: LatentBasis,
    count: int,
    *,
    like: str = "",
    seed: int = 0,
    progress: Progress = silent,
) -> list[CodedBrdf]:
    """Plausible materials that nobody measured.

    Their codes are drawn from the density of codes. Those that are less plausible than 95 % of the
    training materials are drawn again, and so are those that reflect more than arrives.

    Parameters
    ----------
    basis
        One that knows what materials are like.
    count
        How many.
    like
        A kind of material (:data:`nacre.latent.kinds.KINDS`), a part of the names of training
        materials, or a file of a material or a code that they are to be like; anything where empty.
    seed
        The same seed gives the same materials.
    progress
        Called as materials are found.

    Raises
    ------
    NacreError
        If the basis does not know what materials are like, nothing in it is like that, or hardly
        any draw is plausible.
    """
    prior = known_prior(basis)
    level = prior.level()
    about: Sequence[int] | None = None
    center: npt.NDArray[np.float32] | None = None
    if like and Path(like).is_file():
        center = coded([Path(like)], basis)[0].code
    elif like:
        about = members(basis, like)
    seeds = np.random.default_rng((seed, 9))
    label = Path(like).stem if center is not None else like or "drawn"
    found: list[CodedBrdf] = []
    for _ in range(_ROUNDS):
        own = int(seeds.integers(1 << 31))
        if center is not None:
            codes = prior.around(center, _DRAWN, own)
        else:
            codes = prior.sample(_DRAWN, own, about)
        for code in codes[prior.log_density(codes) >= level]:
            material = basis.decode(code, f"{label} {len(found) + 1}")
            if largest_albedo(material) <= 1.0:
                found.append(material)
                progress("drawing", len(found), count, "")
            if len(found) == count:
                return found
    raise NacreError(f"of {_ROUNDS * _DRAWN} draws, only {len(found)} are plausible: ask for fewer")


def project_material(material: CodedBrdf) -> CodedBrdf:
    """The closest material that is as plausible as most training materials; see
    :meth:`nacre.latent.Prior.project`. What is plausible stays as it is.

    Raises
    ------
    NacreError
        If the basis does not know what materials are like.
    """
    code = known_prior(material.basis).project(material.code)
    return material.basis.decode(code, material.name)
