"""Pairs of directions to measure, chosen by what pictures of the material then show.

After the idea of Cao, Jönsson, Huang and Unger 2026, "Rendering-Aware Sparse Sampling for BRDF
Acquisition" (arXiv 2604.26740): what reconstructs the material stays as it is, and the places of
the samples are chosen for the smallest error of pictures. These are our own implementations, which
choose greedily from given pairs where the paper follows gradients.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.brdf import Brdf
from nacre.color import GAMMA, luminance
from nacre.latent.descent import torch
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import DARK
from nacre.measuring import Exposures
from nacre.measuring.design import ALIKE, NOISE, REACH
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DirectionalLight, EnvironmentLight
from nacre.mitsuba.sphere import frames, sphere_normals
from nacre.mitsuba.studio import studio
from nacre.neural.inputs import ENHANCED, PAPER
from nacre.numerics.mlp import AnyLayer, forward
from nacre.runtime.device import one_thread
from nacre.sampling.lit_views import LitViews
from nacre_lab.sparse.set_encoder import SHIFT, SetEncoder, embedded, generated, relative

DRAWS = 512
"""Codes from the prior that a regression sees."""
LOOKED_AT = 160
"""Pairs that one step through the set encoder looks at, drawn anew each time."""


def sphere_views(
    environment: Environment | None = None, size: int = 12, directions: int = 48
) -> LitViews:
    """Pixels of the deterministic sphere, under the environment and under the directional light.

    The environment, the included studio by default, is taken as gray.
    """
    normals, mask = sphere_normals(size)
    local = frames(normals[mask])
    exposed = (studio() if environment is None else environment).exposed()
    lights = EnvironmentLight(exposed, directions), DirectionalLight()
    found = [light.incident(local) for light in lights]
    counts = [np.bincount(points, minlength=len(local)) for *_, points in found]
    widths = [int(count.max()) for count in counts]
    wi = np.zeros((len(local), sum(widths), 3), np.float32)
    wi[..., 2] = 1.0  # where nothing is, with weight 0
    weights = np.zeros((len(local), len(lights), sum(widths)), np.float32)
    for index, (directions_, radiance, points) in enumerate(found):
        order = np.argsort(points, kind="stable")
        starts = np.cumsum(counts[index]) - counts[index]
        at = np.arange(len(points)) - starts[points[order]] + sum(widths[:index])
        wi[points[order], at] = directions_[order]
        shade = luminance(tuple(radiance.T)) * directions_[:, 2]
        weights[points[order], index, at] = shade[order]
    wo = np.broadcast_to(local[:, None, :, 2], wi.shape)
    return LitViews(wi, np.ascontiguousarray(wo), weights)


def single_pairs(count: int, seed: int) -> LitViews:
    """Single pairs of directions in place of pictures, those at which materials are looked at."""
    wi, wo = (w[:, None] for w in shared_directions(count, seed))
    return LitViews(wi, wo, np.pi * wi[:, None, :, 2])


def shown(f_r: Floats, lit: LitViews) -> Floats:
    """Displayed values, shape (..., v, lights, 3), for f_r of shape (..., v, n, 3)."""
    return np.asarray(np.clip(lit.radiance(f_r), 0.0, 1.0) ** (1.0 / GAMMA))


def regressed(read: npt.ArrayLike, pictures: npt.ArrayLike, count: int) -> list[int]:
    """Readings chosen one by one so that a linear regression on them explains the pictures best.

    Parameters
    ----------
    read
        Draws of what could be read, with its noise, shape (draws, readings, channels).
    pictures
        The pictures of the same draws, shape (draws, pixels).
    count
        How many readings to choose.

    Returns
    -------
    list
        Their indices. With normal draws without end, each is the reading that leaves the least
        variance of the pictures.
    """
    left = np.array(read, np.float64)
    left -= left.mean(axis=0)
    wanted = np.array(pictures, np.float64)
    wanted = _principal(wanted - wanted.mean(axis=0))
    floor = 1e-9 * np.square(left).sum(axis=0).mean() * np.eye(left.shape[2])
    chosen: list[int] = []
    for _ in range(count):
        columns = left.transpose(1, 2, 0)
        gram = columns @ columns.swapaxes(1, 2) + floor
        told = columns @ wanted
        gain = np.einsum("rcp,rcp->r", told, np.linalg.solve(gram, told))
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        axes = np.linalg.qr(left[:, best])[0]
        wanted -= axes @ (axes.T @ wanted)
        flat = left.reshape(len(left), -1)
        left = (flat - axes @ (axes.T @ flat)).reshape(left.shape)
    return chosen


def _principal(pictures: Doubles) -> Doubles:
    """Pictures (draws, pixels) in fewer values, which hold all but a thousandth of the variance."""
    axes, lengths, _ = np.linalg.svd(pictures, full_matrices=False)
    held = np.cumsum(lengths**2) / np.square(lengths).sum()
    kept = int(np.searchsorted(held, 0.999)) + 1
    return np.asarray(axes[:, :kept] * lengths[:kept])


def by_regression(
    basis: NeuralBasis, exposures: Exposures, lit: LitViews, count: int, seed: int
) -> list[int]:
    """Pairs that tell most about pictures of materials drawn from the prior of a basis."""
    random = np.random.default_rng((seed, 21))
    wi, wo = exposures.wi[:, 0], exposures.wo[:, 0]
    codes = basis.prior.sample(DRAWS, seed)
    cosine = wi[:, 2:]
    logs = np.log(basis.reflectances(codes, wi, wo) * cosine + DARK)
    inputs = isotropic_inputs(wi, wo, ENHANCED).astype(np.float64)
    apart = np.square(inputs[:, None] - inputs).sum(axis=2)
    alike = ALIKE**2 * np.exp(-0.5 * apart / REACH**2) + NOISE**2 * np.eye(len(wi))
    root = np.linalg.cholesky(alike)
    noise = root @ random.normal(size=(len(codes), len(wi), 3))
    pixels = lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)
    pictures = [
        shown(basis.reflectances(some, *pixels).reshape(-1, *lit.wi.shape), lit)
        for some in np.split(codes, DRAWS // 64)
    ]
    seen = np.concatenate(pictures).reshape(DRAWS, -1)
    return regressed(logs + noise, seen, count)


def through_encoder(
    encoder: SetEncoder,
    materials: Sequence[Brdf],
    exposures: Exposures,
    lit: LitViews,
    count: int,
    seed: int,
) -> list[int]:
    """Pairs from which a set encoder makes the best pictures of some materials.

    Each is the best of :data:`LOOKED_AT`, by the mean squared difference of displayed values.
    """
    random = np.random.default_rng((seed, 22))
    wi, wo = exposures.wi[:, 0], exposures.wo[:, 0]
    pixels = lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)
    reference = encoder.reference.eval(wi, wo)
    inputs = isotropic_inputs(wi, wo, PAPER)
    layers = _tensors(encoder.encoder)
    hyper = [_tensors(each) for each in encoder.hyper]
    looks = torch.from_numpy(isotropic_inputs(*pixels, PAPER))
    median = torch.from_numpy(encoder.reference.eval(*pixels) + np.float32(SHIFT))
    weights = torch.from_numpy(lit.weights)

    def pictures(f_r: Any) -> Any:
        radiance = weights @ f_r.clamp(min=0.0).reshape(-1, *lit.wi.shape)
        return radiance.clamp(1e-6, 1.0) ** (1.0 / GAMMA)

    with one_thread(), torch.no_grad():
        rows = [np.concatenate([inputs, relative(m.eval(wi, wo), reference)], 1) for m in materials]
        parts = [embedded(torch.from_numpy(row.astype(np.float32)), layers) for row in rows]
        truths = [pictures(torch.from_numpy(m.eval(*pixels))) for m in materials]
        chosen: list[int] = []
        for index in range(count):
            looked = random.permutation(np.setdiff1d(np.arange(len(wi)), chosen))[:LOOKED_AT]
            errors = torch.zeros(len(looked))
            for part, truth in zip(parts, truths, strict=True):
                codes = (part[chosen].sum(dim=0) + part[looked]) / (index + 1)
                networks = generated(codes, hyper)
                values = forward(looks.expand(len(looked), -1, -1).contiguous(), networks)
                f_r = torch.expm1(values.clamp(max=20.0)) * median - SHIFT
                missed = pictures(f_r) - truth
                errors += missed.square().mean(dim=(1, 2, 3))
            chosen.append(int(looked[int(errors.argmin())]))
    return chosen


def _tensors(layers: Sequence[AnyLayer]) -> list[tuple[Any, Any]]:
    return [(torch.from_numpy(weights), torch.from_numpy(biases)) for weights, biases in layers]
