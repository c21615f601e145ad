"""GLSL for networks with placeholders for their numbers: one text serves all networks of a shape.

With shaders for a hundred networks, a page would take megabytes. Here the weights, and the
parameters of the sampler, stay open as `@3@`; the page fills them in from a material's file, packed
or dropped onto it, as :class:`Template` describes.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from nacre.array import Components
from nacre.brdf import Sampler, eval_formula, pdf_formula, sample_formula
from nacre.compile.data import Datum, as_data
from nacre.compile.pairs import inside
from nacre.neural.inputs import INPUTS, has_axes, network_inputs, rotates_half_vector
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import describe_sampler, make_sampler
from nacre.sampling.mixture import in_frame
from nacre.targets.glsl import GlslLanguage
from nacre.targets.program import PAIR, Function

NAME = "material"
"""Prefix of functions: `material_eval(wi, wo)`, `material_sample(wo, u)` with the density as fourth
number, `material_pdf(wi, wo)`."""

_Formula: TypeAlias = tuple[Callable[..., Sequence[Any]], Mapping[str, int], Sequence[str]]
"""A function of components, its parameters by name, and the names of its results."""


@dataclasses.dataclass(frozen=True)
class Template:
    """GLSL with placeholders for the numbers of a network and its sampler.

    Parameters
    ----------
    key
        What networks that can fill it have in common; see :func:`key_of`.
    text
        `@k@` stands for number k of `places`.
    places
        A whole number is the index of a weight: layer by layer, weights before biases, as in files.
        Otherwise it is a formula of the sampler's parameters: ["parameter", n], in the order of its
        description; ["angle"] and ["sampler angle"], for the axes of both; ["neg", a], ["cos", a],
        ["add", a, b] and the like, on formulas and numbers, in double precision.
    """

    key: str
    text: str
    places: Sequence[Any]


class _Open(GlslLanguage):
    """GLSL that leaves numbers open."""

    def __init__(self) -> None:
        self.places: list[Any] = []
        self._known: dict[str, int] = {}

    def _place(self, what: Any) -> str:
        found = self._known.setdefault(json.dumps(what), len(self.places))
        if found == len(self.places):
            self.places.append(what)
        return f"@{found}@"

    def datum(self, origin: Any) -> str:
        return self._place(origin_as_json(origin))

    def numbers(self, values: Any) -> str:
        """See :class:`nacre.targets.source.Language`; weights are their own places here."""
        return self.vector([self._place(int(value)) for value in values])


def key_of(network: NeuralBrdf) -> str:
    """What a network's text depends on besides its numbers, as JSON.

    These are its inputs, isotropy, sizes and activation, and the shape of its sampler: the
    description with "number" in place of each number and a count in place of each list of numbers.
    """
    return json.dumps(
        [
            network.inputs,
            network.isotropic,
            list(network.sizes),
            network.activation,
            shape_of(describe_sampler(network.sampler)),
        ],
        separators=(",", ":"),
    )


def shape_of(description: Any) -> Any:
    """A description of a sampler without its numbers; see :func:`key_of`."""
    if isinstance(description, Mapping):
        return {key: shape_of(value) for key, value in sorted(description.items())}
    if isinstance(description, list | tuple):
        if all(isinstance(value, float | int) for value in description):
            return len(description)
        return [shape_of(value) for value in description]
    return "number" if isinstance(description, float | int) else description


def template(network: NeuralBrdf) -> Template:
    """The text that a network shares with all others of its shape.

    If a network or a sampler has axes at an angle, it is evaluated at angle 0 in a rotated frame.
    """
    sampler, numbered = network.sampler, _numbered(network)
    axis: _Axis | None = None
    across: _Axis | None = None
    if has_axes(network.inputs, network.isotropic):
        axis = _axis(network.angle, "angle")
    described = describe_sampler(sampler)
    if described.get("angle") is not None:
        across = _axis(described["angle"], "sampler angle")
        sampler = make_sampler({**described, "angle": 0.0})

    def values(wi: Components, wo: Components) -> Sequence[Any]:
        return eval_formula(numbered, _in(axis, wi), _in(axis, wo))

    formulas: dict[str, _Formula] = {
        "eval": (values, PAIR, ("rgb",)),
        **_sampling(as_data(sampler), across),
    }
    language = _Open()
    return Template(key_of(network), _written(language, formulas), language.places)


def sampler_source(sampler: Sampler) -> str:
    """`material_sample` and `material_pdf` of a sampler as GLSL, with its numbers filled in."""
    return _written(GlslLanguage(), _sampling(sampler))


def _written(language: GlslLanguage, formulas: Mapping[str, _Formula]) -> str:
    return "\n\n".join(
        language.function(Function.of(name, *formula, expanded=language.expanded), f"{NAME}_{name}")
        for name, formula in formulas.items()
    )


def input_sources() -> dict[str, str]:
    """GLSL for the inputs of networks, by which a page writes networks of any sizes.

    `material_first(wi, wo)` are the first four inputs and `material_second(wi, wo)` the others,
    padded with zeros, for axes at angle 0. Keys such as "enhanced true" have the name of the inputs
    and whether networks are isotropic.
    """

    def source(inputs: str, isotropic: bool) -> str:
        def part(of: slice) -> Callable[..., Sequence[Any]]:
            return lambda wi, wo: ((*network_inputs(wi, wo, isotropic, inputs), *(0.0,) * 4)[of],)

        parts = {"first": part(slice(4)), "second": part(slice(4, 8))}
        formulas = {name: (formula, PAIR, ("x",)) for name, formula in parts.items()}
        return _written(GlslLanguage(), formulas)

    return {
        f"{inputs} {str(isotropic).lower()}": source(inputs, isotropic)
        for inputs in INPUTS
        for isotropic in (True, False)
        if not isotropic or rotates_half_vector(inputs, True)
    }


def _sampling(sampler: Sampler, across: _Axis | None = None) -> dict[str, _Formula]:
    """Formulas for a sampler whose axes lie at an angle."""
    back = None if across is None else (across[0], -across[1])

    def drawn(wo: Components, u: Components) -> Sequence[Any]:
        wi, pdf = sample_formula(sampler, _in(across, wo), inside("u", u))
        return _in(back, wi), pdf

    def density(wi: Components, wo: Components) -> Sequence[Any]:
        return pdf_formula(sampler, _in(across, wi), _in(across, wo))

    return {
        "sample": (drawn, {"wo": 3, "u": 3}, ("wi", "pdf")),
        "pdf": (density, PAIR, ("pdf",)),
    }


def _numbered(network: NeuralBrdf) -> NeuralBrdf:
    """A network whose weights are their indices, with axes at angle 0."""
    layers, start = [], 0
    for layer in network.layers:
        parts = []
        for array in layer:
            places = np.arange(start, start + array.size, dtype=np.float32)
            parts.append(places.reshape(array.shape))
            start += array.size
        layers.append(Layer(*parts))
    return NeuralBrdf(
        layers,
        isotropic=network.isotropic,
        inputs=network.inputs,
        activation=network.activation,
    )


_Axis = tuple[Datum, Datum]


def _axis(angle: float, name: str) -> _Axis:
    """Cosine and sine of an angle that files have under a name."""
    return Datum(math.cos(angle), ("cos", name)), Datum(math.sin(angle), ("sin", name))


def _in(axis: _Axis | None, w: Components) -> Components:
    """A direction in the frame of an axis, if there is one."""
    return w if axis is None else in_frame(w, *axis)


def origin_as_json(origin: Any) -> Any:
    """The origin of a datum as JSON: its place, or how it is computed from others."""
    if isinstance(origin, str):
        return [origin]
    if isinstance(origin, int):
        return ["parameter", origin]
    if isinstance(origin, tuple):
        name, *values = origin
        return [name, *(origin_as_json(value) for value in values)]
    return float(origin)
