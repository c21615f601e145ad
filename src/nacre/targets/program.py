"""A material as a program on numbers, which every target writes in its own language."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nacre.array import Components, Weights
from nacre.brdf import Brdf, eval_formula, pdf_formula, sample_formula
from nacre.compile.pairs import inside
from nacre.compile.trace import FLOAT, Formulas, Operation, Trace, needed
from nacre.errors import NacreError
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.prune import without_inactive_units

NATIVE: Formulas = {}
"""For languages whose own elementary functions are accurate."""

PAIR = {"wi": 3, "wo": 3}
"""Parameters for a pair of directions, and the count of numbers in each."""


@dataclass(frozen=True)
class Function:
    """A function of a material, without branches and loops.

    Parameters
    ----------
    name
        "eval", "sample" or "pdf".
    parameters
        The count of numbers in each parameter, by name and in order.
    operations
        The operation behind each value, by its number and in order; see :mod:`nacre.compile.trace`.
    results
        The values in each result, by name and in order.
    numbers, tables, origins
        As in the trace.
    """

    name: str
    parameters: Mapping[str, int]
    operations: Mapping[int, Operation]
    results: Mapping[str, Sequence[int]]
    numbers: Sequence[float]
    tables: Sequence[Weights]
    origins: Mapping[int, Any]

    def parameter(self, index: int) -> tuple[str, int]:
        """The parameter that an input belongs to, and its index there."""
        for name, count in self.parameters.items():
            if index < count:
                return name, index
            index -= count
        raise IndexError("there are fewer inputs")

    def number(self, value: int) -> float | None:
        """The number that a value always has, if it is constant."""
        _, name, *arguments = self.operations[value]
        if name == "number":
            return self.numbers[arguments[0]]
        return float(arguments[0]) if name in ("literal", "whole") else None

    @classmethod
    def of(
        cls,
        name: str,
        formula: Callable[..., Sequence[Any]],
        parameters: Mapping[str, int],
        results: Sequence[str],
        *,
        expanded: Formulas = NATIVE,
    ) -> Function:
        """The function that a formula computes.

        The formula takes a tuple of components for each parameter, and returns a value or a tuple
        for each result. `expanded` elementary functions are composed of others; see
        :class:`nacre.compile.trace.Trace`. Raises TypeError, AttributeError or ValueError if the
        formula uses anything but the functions of :class:`nacre.array.Namespace`.
        """
        trace, count = Trace(expanded=expanded), itertools.count()
        given = (tuple(trace.input(next(count)) for _ in range(n)) for n in parameters.values())
        found: dict[str, Sequence[int]] = {}
        for result, output in zip(results, formula(*given), strict=True):
            parts = output if isinstance(output, tuple) else (output,)
            found[result] = tuple(trace.as_value(part, FLOAT).number for part in parts)
        order = needed(trace.operations, itertools.chain(*found.values()))
        operations = {number: trace.operations[number] for number in order}
        return cls(name, parameters, operations, found, trace.numbers, trace.tables, trace.origins)


def program(brdf: Brdf, *, expanded: Formulas = NATIVE) -> dict[str, Function]:
    """The functions that :meth:`nacre.Brdf.eval`, `sample` and `pdf` compute, by these names.

    Units of a network that are never active are left out. `expanded` elementary functions are
    composed of others; see :class:`nacre.compile.trace.Trace`.

    Raises
    ------
    NacreError
        If the reflectance is not made of formulas.
    """
    if isinstance(brdf, NeuralBrdf):
        brdf = without_inactive_units(brdf)
    sampler = brdf.sampler

    def drawn(wo: Components, u: Components) -> Sequence[Any]:
        return sample_formula(sampler, wo, inside("u", u))

    formulas: dict[str, tuple[Callable[..., Sequence[Any]], Mapping[str, int], Sequence[str]]] = {
        "eval": (lambda wi, wo: eval_formula(brdf, wi, wo), PAIR, ("rgb",)),
        "sample": (drawn, {"wo": 3, "u": 3}, ("wi", "pdf")),
        "pdf": (lambda wi, wo: pdf_formula(sampler, wi, wo), PAIR, ("pdf",)),
    }
    try:
        return {
            name: Function.of(name, *formula, expanded=expanded)
            for name, formula in formulas.items()
        }
    except (TypeError, AttributeError, ValueError) as error:
        what = f"{brdf.name or 'this material'} ({type(brdf).__name__})"
        raise NacreError(
            f"{what} is not a formula: fit a network to it first (nacre fit)"
        ) from error
