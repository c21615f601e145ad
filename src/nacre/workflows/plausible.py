"""Plausible materials: drawn like those a basis was trained on, or moved closer to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError
from nacre.figures.code_views import coded
from nacre.included import resolve
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.kinds import members
from nacre.latent.prior import Prior
from nacre.metrics import albedo
from nacre.runtime.progress import Progress, silent

VIEWS = 0.0, 0.8, 1.3
"""Polar angles of views in radians at which drawn materials must not reflect too much light."""
_DRAWN, _ROUNDS = 64, 40  # codes drawn at a time, and how often before giving up
_POINTS = 256  # directions behind an albedo


@dataclass(frozen=True)
class Plausibility:
    """How plausible a material is.

    Parameters
    ----------
    log_density
        Natural logarithm of the density of its code.
    typical
        Fraction of the training materials, in [0, 1], that are less plausible when left out.
    albedo
        Largest albedo at three views, of all channels; above 1, the material creates light.
    """

    log_density: float
    typical: float
    albedo: float


def plausibility(material: CodedBrdf) -> Plausibility:
    """How plausible a material from a basis is.

    Raises
    ------
    NacreError
        If the basis was trained on too few materials to tell.
    """
    prior = _prior(material.basis)
    log_density = float(prior.log_density(material.code))
    typical = float((prior.left_out() < log_density).mean())
    return Plausibility(log_density, typical, _largest_albedo(material))


def _prior(basis: LatentBasis) -> Prior:
    if len(basis.prior.orders) < 2:
        raise NacreError("the basis was trained on too few materials to say what is plausible")
    return basis.prior


def _largest_albedo(material: CodedBrdf) -> float:
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

    Their codes are drawn from the density of codes. Those less plausible than the least plausible
    5 % of the training materials are drawn again, and so are those that reflect more light than
    they receive.

    Parameters
    ----------
    basis
        A basis trained on at least two materials.
    count
        Number of materials.
    like
        A kind of material (:data:`nacre.latent.kinds.KINDS`), a part of the training materials'
        names, or the path of a material or code to resemble; anything if empty.

    Raises
    ------
    NacreError
        If the basis was trained on too few materials, none of them is `like` that, or too few
        draws are plausible.
    """
    prior = _prior(basis)
    level = prior.level()
    about: Sequence[int] | None = None
    center: npt.NDArray[np.float32] | None = None
    if like and (file := resolve(like)).is_file():
        center = coded([file], basis)[0].code
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
            if _largest_albedo(material) <= 1.0:
                found.append(material)
                progress("drawing", len(found), count, "")
            if len(found) == count:
                return found
    raise NacreError(f"of {_ROUNDS * _DRAWN} draws, only {len(found)} are plausible: ask for fewer")


def project_material(material: CodedBrdf) -> CodedBrdf:
    """The nearest material more plausible than the least plausible 5 % in training.

    See :meth:`nacre.latent.Prior.project`; a plausible material stays as it is.

    Raises
    ------
    NacreError
        If the basis was trained on too few materials to tell.
    """
    code = _prior(material.basis).project(material.code)
    return material.basis.decode(code, material.name)
