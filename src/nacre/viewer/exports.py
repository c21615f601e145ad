"""What a page needs to write shader code as the export targets do.

Formulas are recorded operation by operation (:class:`nacre.compile.trace.Trace`), with the numbers
of a network and of its sampler open. The page (`page/exports.js`) repeats the operations with the
numbers of a file, and writes them with the rules of :mod:`nacre.targets.source`.
"""

from __future__ import annotations

import copy
import itertools
import json
from collections.abc import Callable, Iterator, Sequence
from importlib import resources
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.brdf import Sampler, above_horizon, pdf_formula, sample_formula
from nacre.compile.data import Datum, as_data
from nacre.compile.pairs import inside
from nacre.compile.trace import FLOAT, Trace
from nacre.geometry import cosine_hemisphere, uniform_rusinkiewicz
from nacre.neural.inputs import INPUTS, has_axes, input_count, rotates_half_vector
from nacre.neural.nbrdf import OUTPUTS, NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import GgxLobe, GgxMixture, describe_sampler
from nacre.sampling.parametrizations import MixtureParametrization
from nacre.targets.circular import CIRCULAR
from nacre.targets.glsl import GlslLanguage
from nacre.targets.program import PAIR
from nacre.targets.text import CONVENTIONS
from nacre.targets.three import REFLECTANCE, REVISION
from nacre.viewer.programs import origin_as_json, shape_of

Recorded = dict[str, Any]
"""Operations of a formula, the numbers of its results, and which inputs a network sees, as JSON."""


def shared() -> dict[str, Any]:
    """What exports of all networks need, as JSON.

    `values` are formulas of networks with a single unit between inputs and outputs, by the name of
    the inputs, whether the network is isotropic, and whether its axes lie at an angle. `pairs` draw
    the directions at which units are looked at (:mod:`nacre.neural.prune`), from the state of
    NumPy's generator that is `random`.
    """
    state = np.random.default_rng(0).bit_generator.state["state"]
    return {
        "values": {
            _as_key(inputs, isotropic, angled): _values(inputs, isotropic, angled)
            for inputs, isotropic, angled in itertools.product(INPUTS, (True, False), (True, False))
            if (not isotropic or rotates_half_vector(inputs, True))
            and (not angled or has_axes(inputs, isotropic))
        },
        "samplers": {sampler_key(each): sampling(each) for each in _usual_samplers()},
        "pairs": {
            "angles": _recorded(uniform_rusinkiewicz, (4,)),
            "cosines": _recorded(lambda u: (_cosine(u[:2]), _cosine(u[2:])), (4,)),
        },
        "random": [str(state["state"]), str(state["inc"])],
        "conventions": list(CONVENTIONS),
        "opening": list(GlslLanguage().opening()),
        "three": {
            "text": resources.files("nacre.targets").joinpath("three.js").read_text("utf-8"),
            "values": {**REFLECTANCE, "REVISION": REVISION},
        },
    }


def _usual_samplers() -> Iterator[Sampler]:
    """Lobes as fits have them: one or two, without axes, along x, or at an angle."""
    cosines = MixtureParametrization.cosines
    some = tuple(0.1 + 0.01 * k for k in range(len(cosines)))
    for count, angle in itertools.product((1, 2), (None, 0.0, 0.5)):
        yield GgxMixture((GgxLobe(some, some, some, some),) * count, some, some, cosines, angle)


def sampler_key(sampler: Sampler) -> str:
    """What samplers have in common that need the same operations: :func:`sampling`."""
    described = describe_sampler(sampler)
    return _as_key(shape_of(described), bool(described.get("angle")))


def _as_key(*parts: Any) -> str:
    """JSON as browsers write it."""
    return json.dumps(parts, separators=(",", ":"))


def sampling(sampler: Sampler) -> dict[str, Recorded]:
    """How a sampler draws directions, and their density, with its numbers open."""
    opened = copy.copy(as_data(sampler))
    if describe_sampler(sampler).get("angle"):
        object.__setattr__(opened, "angle", Datum(opened.angle, "sampler angle"))

    def drawn(wo: Components, u: Components) -> Sequence[Any]:
        return sample_formula(opened, wo, inside("u", u))

    def density(wi: Components, wo: Components) -> Sequence[Any]:
        return pdf_formula(opened, wi, wo)

    return {
        "sample": _recorded(drawn, (3, 3)),
        "pdf": _recorded(density, tuple(PAIR.values())),
    }


def _cosine(u: Components) -> Components:
    return cosine_hemisphere(u[0], u[1])


def _values(inputs: str, isotropic: bool, angled: bool) -> Recorded:
    sizes = input_count(inputs, isotropic), 1, OUTPUTS
    # Weights that are the indices of inputs show which of these are constant zeros, and left out.
    layers = [
        Layer(
            np.arange(rows * columns, dtype=np.float32).reshape(rows, columns),
            np.ones(columns, np.float32),
        )
        for rows, columns in itertools.pairwise(sizes)
    ]
    network = NeuralBrdf(layers, isotropic=isotropic, inputs=inputs)

    def formula(wi: Components, wo: Components) -> Sequence[Any]:
        turned = (_turned(wi), _turned(wo)) if angled else (wi, wo)
        return (above_horizon(network.eval_components(*turned), wi, wo),)

    return _recorded(formula, tuple(PAIR.values()))


def _turned(w: Components) -> Components:
    """A direction in the frame of the inputs' axes, as :func:`nacre.geometry.rotate` has it."""
    cos, sin = Datum(1.0, ("cos", "angle")), Datum(0.0, ("neg", ("sin", "angle")))
    return cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]


def _recorded(formula: Callable[..., Sequence[Any]], counts: Sequence[int]) -> Recorded:
    """A formula of tuples of so many components; `inputs` are the weights of its first layer."""
    trace, places = Trace(expanded=CIRCULAR), itertools.count()
    given = (tuple(trace.input(next(places)) for _ in range(count)) for count in counts)
    results = []
    for output in formula(*given):
        parts = output if isinstance(output, tuple) else (output,)
        results.append([trace.as_value(part, FLOAT).number for part in parts])
    return {
        "operations": [_as_json(trace, operation) for operation in trace.operations],
        "results": results,
        "inputs": trace.tables[0].astype(int).tolist() if trace.tables else [],
    }


def _as_json(trace: Trace, operation: Sequence[Any]) -> list[Any]:
    _, name, *arguments = operation
    if name == "number":
        return [name, trace.numbers[arguments[0]]]
    if name == "datum":
        return [name, origin_as_json(trace.origins[arguments[0]])]
    return [name, *arguments]


def hold(sampler: Sampler, known: dict[str, Any]) -> None:
    """Add a sampler to those that are known by :func:`sampler_key`, unless it is."""
    if (key := sampler_key(sampler)) not in known:
        known[key] = sampling(sampler)
