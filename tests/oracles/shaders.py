"""What runners of shaders share: how a shader calls a material, and how it is run and timed."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from nacre.array import Weights
from tests.oracles.runner import Runner, best_rate

_REPEATED = 16  # evaluations of a pair where speed is measured
_COLUMNS = {"eval": 3, "pdf": 1, "sample": 4}


class Pass(abc.ABC):
    """A compiled shader and its input: four numbers from each pair of vectors."""

    @abc.abstractmethod
    def execute(self) -> None:
        """Compute all results and wait until they are there."""

    @abc.abstractmethod
    def read(self) -> Weights:
        """What was computed, float32 of shape (n, 4)."""


class ShaderRunner(Runner):
    """Runs a target of functions in a shading language."""

    vector: ClassVar[str]
    """The language's type of four numbers."""

    loop: ClassVar[str]
    """A function `repeated` of `a` and `b`, as four numbers: the sum of {count} results {call} for
    light directions that a turn about the normal makes of `a`."""

    @abc.abstractmethod
    def compiled(self, source: str, call: str, a: Weights, b: Weights) -> Pass:
        """A shader that computes the expression `call` of vectors `a` and `b`, shapes (n, 3).

        Raises
        ------
        RuntimeError
            If it does not compile; with the words of the compiler.
        """

    def text(self, files: Mapping[str, bytes], name: str, function: str) -> tuple[str, str]:
        """Source of the functions of an export, and a call of one of them."""
        (source,) = files.values()
        return source.decode(), f"{name}_{function}(a, b)"

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        """See :meth:`tests.oracles.runner.Runner.run`."""
        source, call = self.text(files, name, function)
        zeros = ", 0.0" * (4 - _COLUMNS[function])
        shader = self.compiled(source, f"{self.vector}({call}{zeros})", a, b)
        shader.execute()
        found = shader.read()
        return found[:, 0] if function == "pdf" else found[:, : _COLUMNS[function]]

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        """See :meth:`tests.oracles.runner.Runner.rate`.

        Many evaluations for each pair that is read, as shading has them: reading pairs alone takes
        as long as evaluating a network once.
        """
        source, call = self.text(files, name, "eval")
        source += self.loop.format(call=call, count=_REPEATED)
        return best_rate(self.compiled(source, "repeated(a, b)", a, b).execute, _REPEATED * len(a))
