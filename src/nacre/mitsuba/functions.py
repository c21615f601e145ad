"""Anyone's function or network as a reflectance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nacre.array import Components
from nacre.brdf import Brdf, Sampler
from nacre.errors import NacreError, require
from nacre.mitsuba.wrapped import WrappedBrdf, torch_function
from nacre.neural.chain import ChainBrdf, InputFunction
from nacre.sampling.fit import LobeSampledBrdf

LIBRARIES = "components", "torch", "jax"


class FormulaBrdf(LobeSampledBrdf):
    """f_r from a formula on components (x, y, z) of both directions, of any array library."""

    def __init__(
        self,
        formula: Callable[[Components, Components], Components],
        *,
        isotropic: bool = False,
        name: str = "",
        sampler: Sampler | None = None,
    ) -> None:
        super().__init__(name=name, sampler=sampler)
        self.formula, self.isotropic = formula, isotropic

    def eval_components(self, wi: Components, wo: Components) -> Components:
        red, green, blue = self.formula(wi, wo)
        zero = 0.0 * wi[2] + 0.0 * wo[2]  # a formula may return plain numbers
        return red + zero, green + zero, blue + zero


def reflectance(
    function: Any,
    *,
    library: str | None = None,
    inputs: str | InputFunction | None = None,
    isotropic: bool | None = None,
    name: str = "",
    sampler: Sampler | None = None,
) -> Brdf:
    """A reflectance of a network or a function that is none of nacre's.

    Parameters
    ----------
    function
        - A PyTorch module. A chain of linear layers and activations becomes a
          :class:`nacre.neural.chain.ChainBrdf`, which renders as compiled code and can be saved;
          any other is called by the renderer, with both directions, or with them joined where
          `forward` takes one tensor.
        - A function of JAX or PyTorch arrays of directions to the light and to the viewer, shape
          (n, 3), that returns f_r in 1/sr, shape (n, 3): the renderer calls it.
        - A formula on components: it takes two tuples (x, y, z) and returns red, green and blue, by
          operators and functions of :func:`nacre.array.namespace`.
    library
        What arrays a function takes: one of :data:`LIBRARIES`; by default "torch" for modules,
        "jax" for functions that JAX made, "components" for others.
    inputs
        What a chain sees: see :class:`nacre.neural.chain.ChainBrdf`; by default "directions".
    isotropic
        Whether f_r is unchanged when both directions turn about the normal; by default what the
        inputs say, else false.
    name
        Name of the material, for people.
    sampler
        By default lobes that are fitted on first use.

    Raises
    ------
    NacreError
        If it is nothing of these, or inputs are given for what is no chain.
    """
    if library not in (None, *LIBRARIES):
        raise NacreError(f"library {library!r} is none of {', '.join(LIBRARIES)}")
    settings: dict[str, Any] = {"name": name, "sampler": sampler}
    if _is_module(function):
        from nacre.neural.torch_chain import chain_of

        try:
            layers, activations = chain_of(function)
            return ChainBrdf(
                layers, activations, inputs=inputs or "directions", isotropic=isotropic, **settings
            )
        except (NacreError, ValueError) as error:
            if inputs is not None:
                raise NacreError(str(error)) from error
        called, parameters = torch_function(function)
        return WrappedBrdf(
            called, "torch", parameters=parameters, isotropic=bool(isotropic), **settings
        )
    if not callable(function):
        raise NacreError(f"{type(function).__name__} is neither a material nor a function")
    if inputs is not None:
        raise NacreError("inputs are for modules that are chains of layers; leave them out")
    made_by = type(function).__module__.partition(".")[0]
    library = library or ("jax" if made_by in ("jax", "jaxlib") else "components")
    if library == "components":
        return FormulaBrdf(function, isotropic=bool(isotropic), **settings)
    return WrappedBrdf(function, library, isotropic=bool(isotropic), **settings)


def _is_module(function: Any) -> bool:
    if not any(kind.__module__.startswith("torch.") for kind in type(function).__mro__):
        return False
    return isinstance(function, require("torch.nn", "torch").Module)
