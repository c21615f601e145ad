"""Functions of PyTorch and JAX as reflectances that Mitsuba renders by calling them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Sampler
from nacre.errors import NacreError, require
from nacre.sampling.fit import LobeSampledBrdf


class WrappedBrdf(LobeSampledBrdf):
    """f_r from a function of two arrays of directions, shape (n, 3), that returns shape (n, 3).

    Parameters
    ----------
    function
        Takes unit directions to the light and to the viewer; or parameters, then both.
    library
        "torch" or "jax", whose arrays it takes.
    parameters
        Numbers, shape (p,), that the function takes first; None where it takes none.
    isotropic, name, sampler
        See :class:`nacre.brdf.Brdf`.
    """

    traceable = False

    def __init__(
        self,
        function: Callable[..., Any],
        library: str,
        *,
        parameters: Floats | None = None,
        isotropic: bool = False,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
    ) -> None:
        super().__init__(name=name, source=source, sampler=sampler)
        if library not in ("torch", "jax"):
            raise ValueError(f"library {library!r} is neither torch nor jax")
        self.function, self.library, self.isotropic = function, library, isotropic
        self.parameters = parameters

    @property
    def nbytes(self) -> int | None:
        return None if self.parameters is None else self.parameters.nbytes

    def with_parameters(self, parameters: Floats) -> WrappedBrdf:
        """The same function with other parameters, and the same sampler."""
        settings: dict[str, Any] = {"name": self.name, "source": self.source}
        return WrappedBrdf(self.function, self.library, parameters=parameters,
                           isotropic=self.isotropic, sampler=self.sampler, **settings)  # fmt: skip

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        if xp.library == "drjit":
            raise NacreError(f"{self.name or 'this function'}: is called by its BSDF alone")
        light, view = (np.stack(np.broadcast_arrays(*w), -1).astype(np.float32) for w in (wi, wo))
        light, view = np.broadcast_arrays(light, view)
        shape = light.shape[:-1]
        red, green, blue = self._called(light.reshape(-1, 3), view.reshape(-1, 3)).T
        return red.reshape(shape), green.reshape(shape), blue.reshape(shape)

    def _called(self, light: Floats, view: Floats) -> Floats:
        given = [light, view] if self.parameters is None else [self.parameters, light, view]
        if self.library == "torch":
            torch = require("torch", "torch")
            with torch.no_grad():
                found = self.function(*(torch.from_numpy(np.array(a)) for a in given)).numpy()
        else:
            numpy = require("jax.numpy", "jax")
            found = np.asarray(self.function(*map(numpy.asarray, given)))
        if found.shape != light.shape:
            raise NacreError(
                f"{self.name or 'the function'}: returned shape {found.shape} for {len(light)} "
                f"pairs of directions, expected {light.shape}"
            )
        return np.asarray(found, np.float64)

    def called(self, mi: Any, weights: Any, wi: Components, wo: Components) -> tuple[Array, ...]:
        """f_r on components of a JIT variant, with gradients through the function."""
        dr: Any = require("drjit", "render")
        if dr.flag(dr.JitFlag.SymbolicScope):
            raise NacreError(
                f"{self.name or 'this function'}: is called between kernels; render it within "
                "'with nacre.mitsuba.wavefronts():'"
            )
        tensor = mi.TensorXf
        joined = []
        for w in (wi, wo):
            parts = mi.Vector3f(*(mi.Float(v) for v in w))
            joined.append(tensor(dr.ravel(parts), (dr.width(parts), 3)))
        count = max(int(a.shape[0]) for a in joined)
        joined = [a if a.shape[0] == count else dr.repeat(a, count) for a in joined]
        function = dr.wrap(source="drjit", target=self.library)(self.function)
        found = function(*joined) if weights is None else function(tensor(weights), *joined)
        if tuple(found.shape) != (count, 3):
            raise NacreError(f"{self.name or 'the function'}: returned shape {tuple(found.shape)}")
        flat = dr.unravel(mi.Vector3f, found.array)
        return flat.x, flat.y, flat.z


def torch_function(module: Any) -> tuple[Callable[..., Any], Floats]:
    """A function of a module's parameters, shape (p,), and the directions; and the parameters.

    A module whose `forward` takes one tensor gets both directions joined, shape (n, 6).
    """
    import inspect

    torch = require("torch", "torch")
    call = require("torch.func", "torch").functional_call
    parameters = dict(module.named_parameters())
    names, shapes = list(parameters), [tuple(p.shape) for p in parameters.values()]
    sizes = [p.numel() for p in parameters.values()]
    required = [
        p
        for p in inspect.signature(module.forward).parameters.values()
        if p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
    ]
    joined = len(required) == 1

    def function(flat: Any, light: Any, view: Any) -> Any:
        parts = flat.split(sizes)
        given = {n: part.view(s) for n, part, s in zip(names, parts, shapes, strict=True)}
        arguments = (torch.cat([light, view], -1),) if joined else (light, view)
        return call(module, given, arguments)

    flat = torch.cat([p.detach().reshape(-1).float() for p in parameters.values()])
    return function, np.array(flat.cpu().numpy())
