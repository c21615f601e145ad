"""The facts about a reflectance that hold whatever it is made of."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.metrics.draws import Proposal, draw_pairs
from nacre.metrics.physics import Estimate, albedo, anisotropy, known_fraction, reciprocity_error
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling.energy import VIEWS as CERTIFIED_VIEWS
from nacre.sampling.energy import certify

VIEWS = tuple(range(0, 90, 5))  # polar angles in degrees of the views that albedos are taken at

AZIMUTHS = tuple(range(0, 360, 45))
"""Their azimuths in degrees; the first alone where the material is isotropic."""

UNITS = {
    "unknown pairs": "fraction of pairs of directions, by solid angle",
    "f cos range": "1/sr",
    "albedo at 0 degrees": "red, green, blue: part of the light that is reflected",
    "largest albedo": f"red, green, blue; of views at 0 to {VIEWS[-1]} degrees",
    "largest albedo at": "degrees from the normal",
    "largest albedo azimuth": "degrees",
    "albedo standard error": "the largest",
    "reciprocity error": "0 is reciprocal, 2 the most",
    "anisotropy": "0 is isotropic, 2 the most",
}
"""Units of the values of :func:`physical_facts`."""


def physical_facts(brdf: Brdf) -> dict[str, Any]:
    """Energy, reciprocity, anisotropy and what is known of a reflectance, for people and for JSON.

    Numbers, texts and lists of them; :data:`UNITS` has their units, :mod:`nacre.metrics.physics`
    the definitions. A figure about which nothing is known is None. It takes about 350,000
    evaluations, twice as many for an anisotropic reflectance.
    """
    with one_blas_thread():
        proposal = Proposal(brdf)
        wi, wo = draw_pairs(proposal, 1024)
        known = brdf.valid(wi, wo)
        cosine = wi[known][:, 2:]
        values = brdf.eval(wi[known], wo[known]) * cosine
        reciprocity = reciprocity_error(brdf, proposal=proposal)
        facts: dict[str, Any] = {
            "unknown pairs": 1.0 - known_fraction(brdf),
            "f cos range": [_number(values.min()), _number(values.max())] if values.size else None,
            "negative values": "none, by construction" if brdf.physical else "count as 0",
            **_energy(brdf, proposal),
            "reciprocity": "by construction" if brdf.physical else "found by integration",
            "reciprocity error": _number(reciprocity.value),
            "reciprocity standard error": _number(reciprocity.error),
            "anisotropy": 0.0,
        }
        if not brdf.isotropic:
            rotated = anisotropy(brdf, proposal=proposal)
            facts["anisotropy"] = _number(rotated.value)
            facts["anisotropy standard error"] = _number(rotated.error)
    return facts


def _energy(brdf: Brdf, proposal: Proposal) -> dict[str, Any]:
    theta = np.radians(VIEWS)
    phi = np.radians(AZIMUTHS[:1] if brdf.isotropic else AZIMUTHS)
    count = 1024 if brdf.isotropic else 256
    found = albedo(brdf, theta[:, None], phi, count=count, proposal=proposal)
    flat = Estimate(found.value.reshape(-1, 3), found.error.reshape(-1, 3))
    # A view at which it is not finite counts as the highest.
    highest = np.argmax(np.where(np.isfinite(flat.value), flat.value, math.inf), axis=0)
    row, column = np.unravel_index(highest, found.value.shape[:2])
    degrees = [float(VIEWS[k]) for k in row]
    facts: dict[str, Any] = {
        "albedo at 0 degrees": [_number(v) for v in found.value[0].mean(axis=0)],
        "largest albedo": [_number(flat.value[k, c]) for c, k in enumerate(highest)],
        "largest albedo at": degrees,
    }
    if not brdf.isotropic:
        facts["largest albedo azimuth"] = [float(AZIMUTHS[k]) for k in column]
    certain = flat.value - 3.0 * flat.error
    over = [
        f"{name} at {VIEWS[row[c]]} degrees"
        for c, name in enumerate(("red", "green", "blue"))
        if not np.all(certain[:, c] <= 1.0 + 1e-6)
    ]
    facts["albedo standard error"] = _number(flat.error.max())
    facts["energy"] = f"exceeds 1: {', '.join(over)}" if over else "nowhere above 1"
    if brdf.physical and (bound := certify(brdf).bound) <= 1.0:
        most = f"at most {bound:.4f}, from {CERTIFIED_VIEWS} views and the change between them"
        facts["energy"] = f"nowhere above 1, certified: {most}"
    else:
        facts["energy"] += ", found by integration"
    return facts


def _number(value: Any) -> float | None:
    """A plain number; None where there is none, as JSON has it."""
    return float(value) if math.isfinite(value) else None
