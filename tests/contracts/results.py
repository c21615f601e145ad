"""What nacre's libraries make of materials, as arrays by names that begin with the library."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_info

from nacre.analytic import MODELS
from nacre.analytic import fit as fit_model
from nacre.brdf import Brdf
from nacre.compile.vector_code import LANES
from nacre.latent import find_basis
from nacre.measured import rgl
from nacre.neural import Recipe, fit
from nacre.neural.tiles import LANES as KERNEL_LANES
from nacre.sampling import fit_lobes
from tests.contracts.directions import awkward_pairs, pairs
from tests.contracts.processors import WIDE, Processor, dispatched, features, target_drjit

Results: TypeAlias = dict[str, npt.NDArray[Any]]
Objects: TypeAlias = Mapping[str, Brdf]

FITTED = ("ggx", "openpbr-anisotropic", "satin_rosaline_rgb.bsdf")
RECIPE = Recipe(samples=20_000, epochs=4, hidden=(12, 12))


def results(objects: Objects, processor: Processor, parts: Collection[str]) -> Results:
    """Of the libraries that are named.

    Raises
    ------
    RuntimeError
        If a library does not use the instructions that it was told to.
    """
    found: Results = {}
    for part in parts:
        for name, array in _PARTS[part](objects, processor):
            found[f"{part}/{name}"] = np.asarray(array)
    _check(processor)
    return found


def _check(processor: Processor) -> None:
    lanes = processor.lanes
    used = {"formulas": LANES, "kernel": KERNEL_LANES}
    on = [name for name in dispatched if features[name]]
    used["NumPy"] = 16 if any(name.startswith(WIDE) for name in on) else 8 if on else 4
    wrong = {name: n for name, n in used.items() if n != lanes}
    for library in threadpool_info():
        if library["internal_api"] == "openblas" and library["architecture"] != processor.core:
            wrong[library["filepath"]] = library["architecture"]
    if wrong:
        raise RuntimeError(f"not of {lanes} lanes: {wrong}")


def _compiled(objects: Objects, _: Processor) -> Iterator[tuple[str, Any]]:
    """Formulas as machine code, of float32."""
    wi, wo = awkward_pairs()
    u = np.random.default_rng(3).random(wi.shape, np.float32)
    for name, brdf in objects.items():
        if brdf.traceable:
            yield f"{name}/f_r", brdf.eval(wi, wo)
        yield f"{name}/pdf", brdf.pdf(wi, wo)
        for part, array in zip(("wi", "density"), brdf.sample(wo, u), strict=True):
            yield f"{name}/{part}", array


def _numpy(objects: Objects, _: Processor) -> Iterator[tuple[str, Any]]:
    """NumPy and its matrix products, of float64."""
    wi, wo = (w[:500].astype(np.float64) for w in pairs())
    for name, brdf in objects.items():
        yield f"{name}/f_r", brdf.eval(wi, wo)


def _torch(objects: Objects, _: Processor) -> Iterator[tuple[str, Any]]:
    """Values and slopes of float32 tensors."""
    import torch

    for name, brdf in objects.items():
        if brdf.traceable:
            wi, wo = (torch.tensor(w[:500]) for w in pairs())
            values = brdf.eval(wi.requires_grad_(), wo)
            values.sum().backward()
            yield f"{name}/f_r", values.detach().numpy()
            assert wi.grad is not None
            yield f"{name}/slope", wi.grad.numpy()


def _drjit(objects: Objects, processor: Processor) -> Iterator[tuple[str, Any]]:
    """What is rendered, of float32."""
    from nacre.mitsuba.engine import mitsuba

    mi = mitsuba()
    if target_drjit(processor) != processor.lanes:
        raise RuntimeError("Dr.Jit takes another target")
    wi, wo = (tuple(mi.Float(np.ascontiguousarray(c[:2000])) for c in w.T) for w in pairs())
    for name, brdf in objects.items():
        if brdf.traceable:
            yield f"{name}/f_r", np.stack([np.array(c) for c in brdf.eval_components(wi, wo)], -1)


def _fits(objects: Objects, _: Processor) -> Iterator[tuple[str, Any]]:
    """What is fitted to materials: networks, lobes, models, tables, codes."""
    wi, wo = pairs()
    basis = find_basis("neural")
    for name in set(FITTED) & set(objects):
        brdf = objects[name]
        network = fit(brdf, RECIPE)
        yield f"{name}/network", network.eval(wi, wo)
        yield f"{name}/truth", brdf.eval(wi, wo)
        yield f"{name}/weights", np.concatenate([w.ravel() for x in network.layers for w in x])
        yield f"{name}/lobes", brdf.replaced(sampler=fit_lobes(brdf)).pdf(wi, wo)
        yield f"{name}/model", fit_model(brdf, MODELS["ggx"]).eval(wi, wo)
        if brdf.isotropic:
            yield f"{name}/table", rgl.tabulate(brdf).eval(wi, wo)
            yield f"{name}/code", basis.encode(brdf)


_PARTS: dict[str, Callable[[Objects, Processor], Iterator[tuple[str, Any]]]] = {
    "compiled": _compiled,
    "numpy": _numpy,
    "torch": _torch,
    "drjit": _drjit,
    "fits": _fits,
}
