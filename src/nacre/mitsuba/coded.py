"""The BSDF for a code of a neural basis: 32 values, which an optimization may change."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.brdf import Sampler
from nacre.errors import NacreError, require
from nacre.latent.file import find_basis, is_code, load_code
from nacre.latent.hypernetwork import neural_basis
from nacre.latent.neural_basis import NeuralBasis
from nacre.mitsuba import adapter
from nacre.mitsuba.bsdf_base import base_class, resolved
from nacre.mitsuba.network import opaque

BASIS = "neural"
"""The basis that is used unless another is named: the included one."""


@cache
def coded_class(variant: str) -> Any:
    """The class for the variant that is set; `mitsuba.traverse` shows its parameter `code`.

    Samples are drawn from lobes that the basis predicts from the code, or that are fitted where it
    predicts none. Each update of the code renews them; gradients do not pass through them. All
    codes share one kernel.
    """
    mi: Any = require("mitsuba", "render")
    if mi.Float is float:
        raise NacreError(f"codes need a JIT variant, got {variant}")
    from nacre.latent.drjit import CodeSpace

    class Coded(base_class(variant)):  # type: ignore[misc]
        """The plugin `nbrdf` with the property `code`."""

        def prepare(self, properties: Any, *arguments: Any) -> Any:
            basis, values, self.name = read_code(properties)
            self.space, self.basis = CodeSpace(basis), basis
            self.code = mi.Float(values.astype(np.float32))
            self.lobes()
            return 0

        def lobes(self) -> None:
            dr = require("drjit", "render")
            values = np.array(dr.detach(self.code), np.float64)
            self.sampler = opaque(mi, self.basis.decode(values).sampler)

        def at(self, si: Any, view: Components) -> tuple[None, Sampler]:
            return None, self.sampler

        def f_r(self, state: None, wi: Components, wo: Components) -> Components:
            return self.space.decode(self.code, wi, wo)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            red, green, blue = adapter.albedo(self.material()).tolist()
            return adapter.spectrum(mi, (red, green, blue), si.wavelengths, active)

        def material(self) -> Any:
            """The reflectance for the current code."""
            dr = require("drjit", "render")
            return self.basis.decode(np.array(dr.detach(self.code)), self.name)

        def traverse(self, callback: Any) -> None:
            callback.put("code", self.code, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Any = ()) -> None:
            self.lobes()

        def describe(self) -> dict[str, Any]:
            return {"code dim": self.basis.code_dim, "basis": self.basis.summary()}

    return Coded


def read_code(properties: Any) -> tuple[NeuralBasis, Any, str]:
    """The basis, the values of the code, shape (k,), and a name, from properties in a scene.

    Raises NacreError if the basis is not a neural one, or the number of finite values is not k.
    """
    named = str(properties.get("basis", BASIS))
    basis = neural_basis(
        find_basis(named if named in ("neural", "hypernetwork") else resolved(named))
    )
    text = str(properties["code"])
    path = Path(resolved(text)) if text.endswith(".json") else None
    if path is not None:
        if not is_code(path):
            raise NacreError(f"{path}: is not a code from nacre latent encode")
        material = load_code(path, basis)
        return basis, np.asarray(material.code), material.name
    try:
        return basis, basis.checked([float(x) for x in text.replace(",", " ").split()]), "code"
    except ValueError as error:
        raise NacreError(f"{properties.plugin_name()}: code: {error}") from error
