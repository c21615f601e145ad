"""PBNBRDF: a network that is reciprocal, and whose albedo is an analytic integral.

Zhou et al. 2024, "Physically Based Neural Bidirectional Reflectance Distribution Function", arXiv
2411.02347. What is public besides the abstract says: Helmholtz reciprocity by reparametrized
inputs, energy passivity by an antiderivative whose derivative is f_r, and a loss that supervises
the norms of colors. How these meet could not be found, so this construction is our own.

Let u = sin(theta)^2 for either direction, and phi the azimuth between them. The network H(u_i, u_o,
phi) sees inputs that stay the same when u_i and u_o are swapped, and

    f_r = d^3 H / (du_i du_o dphi),

which is as symmetric. As cos(theta) sin(theta) dtheta = du / 2, the albedo of a view is

    a(u_o) = [ dH / du_o ] taken between u_i = 0 and 1, and between phi = 0 and pi:

four evaluations of a first derivative. Training adds the square of what exceeds 1; what is left is
divided out, as f_r is linear in the last layer. f_r may be negative, and is clamped as any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.geometry import split
from nacre.neural.nbrdf import HALF, PRECISIONS, round_layers
from nacre.neural.training import initial_layers, schedule
from nacre.numerics.mlp import Layer
from nacre.runtime.device import one_thread
from nacre.sampling import LobeSampledBrdf, draw_samples
from nacre_lab.benchmark.peers.jets import ALL, Jet

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any

INPUTS = 6
_LIGHT, _VIEW, _AZIMUTH = 1, 2, 4  # bits of u_i, u_o and phi in jets
_SMOOTH = 2e-3  # added to u before its square root, whose derivative it keeps finite
_HIGHLIGHT = 1e-3  # added before the logarithm of the distance from the mirror direction
_GRAZING = 1.03  # minus u is what opens up grazing angles, by its logarithm
_CEILING = 0.9995  # of the albedo after a division, so that rounding of the weights stays below 1
_TINY = 1e-30


def coordinates(wi: Components, wo: Components) -> tuple[Array, Array, Array]:
    """The smaller and the larger u, and phi in [0, pi], to the same bits for both orders."""
    xp = namespace(*wi, *wo)
    light, view = (1.0 - w[2] * w[2] for w in (wi, wo))
    across = xp.abs(wi[0] * wo[1] - wi[1] * wo[0])
    phi = xp.arctan2(across, wi[0] * wo[0] + wi[1] * wo[1] + _TINY)
    return xp.minimum(light, view), xp.maximum(light, view), phi


def features(first: Any, second: Any, phi: Any, sets: Sequence[int] = ALL) -> list[Jet]:
    """What the network sees, as jets; a swap of the first two changes nothing."""
    xp = namespace(first, second, phi)
    one, two = Jet.variable(first, _LIGHT, sets), Jet.variable(second, _VIEW, sets)
    azimuth = Jet.variable(phi, _AZIMUTH, sets)
    s, c = xp.sin(phi), xp.cos(phi)
    cosine = azimuth.through((c, -1.0 * s, -1.0 * c, s))
    roots = _root(xp, one + _SMOOTH), _root(xp, two + _SMOOTH)
    product = roots[0] * roots[1] * cosine
    apart = one + two * -1.0
    mirror = _log(xp, one + two + product * 2.0 + (2.0 * _SMOOTH + _HIGHLIGHT))
    grazing = (_log(xp, w * -1.0 + _GRAZING) for w in (one, two))
    return [
        one + two + -1.0,
        apart * apart,
        azimuth * (2.0 / math.pi) + -1.0,
        mirror * (1.0 / 7.0),
        (next(grazing) + next(grazing)) * (1.0 / 7.0),
        product,
    ]


def _root(xp: Any, x: Jet) -> Jet:
    root = xp.sqrt(x.parts[0])
    first = 0.5 / root
    second = -0.25 / (root * root * root)
    return x.through((root, first, second, second * -1.5 / (root * root)))


def _log(xp: Any, x: Jet) -> Jet:
    inverse = 1.0 / x.parts[0]
    square = inverse * inverse
    return x.through((xp.log(x.parts[0]), inverse, -1.0 * square, 2.0 * square * inverse))


def _sine(xp: Any, x: Jet, sets: Sequence[int] | None = None) -> Jet:
    s, c = xp.sin(x.parts[0]), xp.cos(x.parts[0])
    return x.through((s, c, -1.0 * s, -1.0 * c), sets)


class PassiveNetwork(LobeSampledBrdf):
    """f_r as the mixed third derivative of a network with sines between its dense layers.

    Parameters
    ----------
    layers
        Dense layers from the 6 :func:`features` to 3 outputs. A bias of the last one multiplies u_i
        u_o phi instead, which makes it a constant of f_r.
    name
        Name of the material.
    """

    isotropy_known = True

    def __init__(self, layers: Sequence[Layer], name: str = "") -> None:
        super().__init__(name=name)
        self.layers = tuple(round_layers(layers, HALF))

    @property
    def nbytes(self) -> int:
        count = sum(layer.weights.size + layer.biases.size for layer in self.layers)
        return PRECISIONS[HALF].itemsize * count

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        values = features(*coordinates(wi, wo))
        *first, last = self.layers
        for layer in first:
            sets = (7,) if layer is first[-1] else ALL
            values = [_sine(xp, value, sets) for value in _dense_components(xp, values, layer)]
        thirds = [value.parts[7] for value in values]
        red, green, blue = xp.dense(thirds, last.weights, last.biases)
        return red, green, blue

    def analytic_albedo(self, cosines: Floats) -> Floats:
        """The analytic albedo of views, shape (n, 3), negative f_r included."""
        parameters = [torch.from_numpy(np.float64(p)) for layer in self.layers for p in layer]
        return np.asarray(AlbedoTerm(1.0 - np.square(np.float64(cosines))).albedo(parameters))


def _dense_components(xp: Any, values: Sequence[Jet], layer: Layer) -> list[Jet]:
    none = np.zeros_like(layer.biases)
    parts = {
        key: xp.dense([v.parts[key] for v in values], layer.weights, none if key else layer.biases)
        for key in values[0].parts
    }
    return [Jet({key: part[unit] for key, part in parts.items()}) for unit in range(len(none))]


def stacked(values: Sequence[Jet]) -> Tensor:
    """Features of NumPy jets as one tensor, shape (sets, n, inputs)."""
    keys = values[0].parts
    shape = np.shape(values[0].parts[0])
    rows = [[np.broadcast_to(value.parts[key], shape) for value in values] for key in keys]
    return torch.from_numpy(np.moveaxis(np.array(rows), 1, 2).copy())


def derivative(inputs: Tensor, parameters: Sequence[Tensor], sets: Sequence[int]) -> Tensor:
    """The last hidden layer's derivative by the last of the sets, shape (n, units), from the sets
    of :func:`stacked` inputs.
    """
    *first, _, _ = parameters
    values = inputs
    for index in range(0, len(first), 2):
        parts = dict(zip(sets, values @ first[index], strict=True))
        parts[0] = parts[0] + first[index + 1]
        wanted = sets[-1:] if index + 2 == len(first) else sets
        found = _sine(torch, Jet(parts), wanted).parts
        values = torch.stack([found[key] for key in wanted])
    return values[0]


class AlbedoTerm:
    """The albedo of some views, by four first derivatives each.

    Parameters
    ----------
    views
        u of the views, shape (n,).
    """

    _sets = (0, _VIEW)

    def __init__(self, views: Floats) -> None:
        corners = [(u, phi) for u in (0.0, 1.0) for phi in (0.0, math.pi)]
        one, phi = (np.repeat([c[k] for c in corners], len(views)) for k in (0, 1))
        values = features(one, np.tile(views, len(corners)), phi, self._sets)
        self._inputs = stacked(values)

    def albedo(self, parameters: Sequence[Tensor]) -> Tensor:
        """Shape (n, 3)."""
        inputs = self._inputs.to(parameters[0].dtype)
        slopes = derivative(inputs, parameters, self._sets)
        none_0, none_pi, all_0, all_pi = slopes.reshape(4, -1, slopes.shape[-1])
        between = all_pi - all_0 - none_pi + none_0
        return between @ parameters[-2] + math.pi * parameters[-1]


@dataclass(frozen=True)
class Training:
    """Settings of a fit."""

    hidden: tuple[int, ...] = (21, 21)
    steps: int = 2000
    batch: int = 512
    samples: int = 200_000
    learning_rate: float = 5e-3
    gain: float = 32.0  # of the loss in logarithms, as nacre's own networks have it
    chromaticity: float = 0.3
    passivity: float = 10.0
    views: int = 48
    seed: int = 0


class _Fit:
    """The samples of a material, and the loss of a network on some of them."""

    def __init__(self, brdf: Brdf, settings: Training) -> None:
        self._settings = settings
        drawn = draw_samples(brdf, settings.samples, settings.seed, None, "mixed")
        values = features(*coordinates(split(drawn.wi), split(drawn.wo)))
        self.inputs = stacked(values).to(torch.float32)
        cosine = settings.gain * drawn.cosine
        self._cosine = torch.from_numpy(np.asarray(cosine, np.float32))[:, None]
        rgb = np.maximum(np.asarray(drawn.rgb, np.float32), 0.0)
        self._target = torch.from_numpy(rgb) * self._cosine
        self._views = AlbedoTerm(np.square(np.sin(np.linspace(0.0, 0.5 * np.pi, settings.views))))

    @cached_property
    def count(self) -> int:
        return len(self._target)

    def loss(self, parameters: Sequence[Tensor], chosen: Tensor) -> Tensor:
        """The mean error in logarithms, that of the norms of colors, and what exceeds albedo 1."""
        thirds = derivative(self.inputs[:, chosen], parameters, ALL)
        weighted = (thirds @ parameters[-2] + parameters[-1]) * self._cosine[chosen]
        target = self._target[chosen]
        error = _difference(weighted, target)
        norms = _difference(weighted.norm(dim=1), target.norm(dim=1))
        above = (self._views.albedo(parameters) - 1.0).relu().square().sum()
        settings = self._settings
        return error + settings.chromaticity * norms + settings.passivity * above


def _difference(values: Tensor, target: Tensor) -> Tensor:
    """Mean |log(1 + x) - log(1 + y)|; for negative x the logarithm is -log(1 - x)."""
    logarithm = torch.copysign(values.abs().log1p(), values)
    return (logarithm - target.log1p()).abs().mean()


def fit_antiderivative(brdf: Brdf, settings: Training) -> PassiveNetwork:
    """A passive and reciprocal network of a material.

    Raises
    ------
    NacreError
        If the material is anisotropic, hardly any of its samples is valid, or training diverges.
    """
    name = brdf.name or "this material"
    if not brdf.isotropic:
        raise NacreError(f"{name}: is for isotropic materials")
    with one_thread():
        layers = _trained(_Fit(brdf, settings), settings)
    if not all(np.isfinite(array).all() for layer in layers for array in layer):
        raise NacreError(f"{name}: training diverged")
    network = PassiveNetwork(layers, brdf.name)
    while (largest := float(network.analytic_albedo(np.linspace(0.0, 1.0, 257)).max())) > 1.0:
        *first, last = network.layers
        scale = _CEILING / largest
        layers = [*first, Layer(scale * last.weights, scale * last.biases)]
        network = PassiveNetwork(layers, brdf.name)
    return network


def _trained(fit: _Fit, settings: Training) -> list[Layer]:
    started = initial_layers(settings.hidden, settings.seed, INPUTS)
    # Third derivatives of the stretched inputs are large: the network starts near f_r = 0.
    started[-1] = Layer(1e-4 * started[-1].weights, started[-1].biases + 0.1)
    parameters = [torch.tensor(p, requires_grad=True) for layer in started for p in layer]
    optimizer = torch.optim.Adam(parameters, foreach=True)
    random = torch.Generator().manual_seed(settings.seed)
    for rate in schedule(settings.steps, settings.learning_rate):
        optimizer.param_groups[0]["lr"] = float(rate)
        chosen = torch.randint(fit.count, (settings.batch,), generator=random)
        optimizer.zero_grad()
        fit.loss(parameters, chosen).backward()
        optimizer.step()
    arrays = [p.detach().numpy() for p in parameters]
    return [Layer(*pair) for pair in zip(arrays[::2], arrays[1::2], strict=True)]
