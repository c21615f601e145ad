"""Mitsuba BSDFs for reflectances: the plugins `nbrdf` and `brdf`; registers all plugins."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from nacre.array import Components
from nacre.brdf import Brdf, Sampler
from nacre.btf import Btf
from nacre.errors import NacreError, require
from nacre.mitsuba import adapter, llvm
from nacre.mitsuba.bsdf_base import base_class, choice, material_path
from nacre.mitsuba.coded import coded_class
from nacre.mitsuba.engine import check_llvm, mitsuba
from nacre.mitsuba.functions import reflectance
from nacre.mitsuba.kernels import count_material
from nacre.mitsuba.network import WEIGHTS, BufferedNetwork, first_in_buffer, opaque
from nacre.mitsuba.textures.plugins import plugins as texture_plugins
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.wrapped import WrappedBrdf
from nacre.neural.chain import ChainBrdf
from nacre.neural.network import NetworkBrdf
from nacre.neural.prune import without_inactive_units
from nacre.neural.spectral import SpectralBrdf
from nacre.sampling import check_isotropic
from nacre.textures.latent_map import LatentMap

if TYPE_CHECKING:
    from nacre.neural.nbrdf import NeuralBrdf


def register() -> None:
    """Register the plugins `nbrdf`, `brdf`, `neuralbtf` and `measuredbtf` with Mitsuba.

    They work in the current variant, if one is set, and in every variant set from now on. Calling
    this again is harmless. `brdf` and `nbrdf` take `filename`, a file that :func:`nacre.load`
    reads. For `nbrdf` it must hold a network, and there are two more properties (see :func:`bsdf`);
    instead of a file it takes `code`, values with commas or a file from `nacre latent encode`, and
    `basis` (see :mod:`nacre.mitsuba.coded`). `measuredbtf` takes a texture and `neuralbtf` an
    encoded one (see :func:`nacre.mitsuba.textures.plugins.texture_bsdf`).

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If the current variant compiles with LLVM and there is none of release 17 or newer.

    Examples
    --------
    >>> import nacre
    >>> nacre.mitsuba.register()
    >>> mi = nacre.mitsuba.mitsuba()  # from here on: {"type": "nbrdf", "filename": ...}
    """
    llvm.prepare()
    mi = require("mitsuba", "render")
    mi.detail.add_variant_callback(_register_variant)
    if mi.variant() is not None:
        _register_variant(None, mi.variant())


FUNCTION_OPTIONS = "library", "inputs", "isotropic", "name", "sampler"


def bsdf(material: Any, **options: Any) -> Any:
    """A Mitsuba BSDF for a material in memory, to put into scene dictionaries.

    If no variant is set, this sets the one that :func:`nacre.mitsuba.mitsuba` starts with.

    Parameters
    ----------
    material
        Any reflectance or texture. A reflectance measured from a Mitsuba BSDF gives that BSDF. Or
        a network or function of anyone's, with the options of
        :func:`nacre.mitsuba.functions.reflectance`: a PyTorch module, a JAX function, a formula.
    options
        For a texture, see :func:`nacre.mitsuba.textures.plugins.texture_bsdf`. For a network:

        - `weights`: how weights enter the renderer. "literals" are compiled into the kernel, which
          renders fastest, but every material is compiled, and large networks compile slowly.
          "cooperative" keeps them in a buffer for Dr.Jit's cooperative vectors, which
          `mitsuba.traverse` shows as the differentiable parameter `weights`: for optimization, and
          one kernel for all networks of the same shape. "auto", the default, takes literals up to
          :data:`nacre.mitsuba.network.MAX_LITERALS` weights, and a buffer for what differs between
          materials decoded from one basis.
        - `precision`: "single" or, for cooperative weights, "half".

    Returns
    -------
    mi.BSDF
        For a reflectance, its method `material()` returns that reflectance with current weights.

    Raises
    ------
    NacreError
        If an option is unknown or does not apply, or the material cannot be rendered.
    """
    mi = mitsuba()
    if not isinstance(material, Brdf | Btf | LatentMap):
        told = {key: options.pop(key) for key in FUNCTION_OPTIONS if key in options}
        material = reflectance(material, **told)
    if not isinstance(material, Brdf):
        return texture_bsdf(material, **options)
    check_isotropic(material)
    if isinstance(material, WrappedBrdf):
        return _called(mi.variant())(mi.Properties("brdf"), material, **options)
    if not material.traceable:
        if (original := getattr(material, "bsdf", None)) is not None:
            return original
        if (latent := getattr(material, "latent", None)) is not None:
            # Rows of a texture run down; turned over, its axes are those of the surface.
            upright = mi.ScalarTransform4f().scale([1.0, -1.0, 1.0])
            return texture_bsdf(latent(), interpolation="linear", to_uv=upright)
    properties = mi.Properties("brdf")
    for key, value in options.items():
        properties[key] = value
    return _plugins(mi.variant())["brdf"](properties, material)


def _register_variant(_: str | None, variant: str) -> None:
    mi = require("mitsuba", "render")
    if variant.startswith("llvm"):
        check_llvm()
    known = _plugins(variant) | texture_plugins(variant)
    known["nbrdf"] = partial(_network_or_code, variant)
    for name, plugin in known.items():
        mi.register_bsdf(name, plugin)


def _network_or_code(variant: str, properties: Any) -> Any:
    if "code" not in properties:
        return _plugins(variant)["nbrdf"](properties)
    if "filename" in properties:
        raise NacreError("nbrdf: give it the property 'filename' or 'code', not both")
    return coded_class(variant)(properties)


@cache
def _plugins(variant: str) -> dict[str, Any]:
    """The plugin classes of the variant that is set, by name."""
    mi: Any = require("mitsuba", "render")

    class Reflectance(base_class(variant)):  # type: ignore[misc]
        """The plugin `brdf`."""

        def prepare(self, properties: Any, brdf: Brdf | None = None) -> Any:
            self.brdf = brdf = self.read(properties) if brdf is None else brdf
            if not brdf.traceable:
                raise NacreError(
                    f"{brdf.name or 'this material'}: {type(brdf).__name__} cannot be rendered as "
                    "it is; fit a network to it first (nacre fit)"
                )
            if brdf.sampler is None:
                raise NacreError(f"{brdf.name or 'this material'}: has no sampler to render with")
            self.albedo: Components | None = None
            self.traced, self.sampler = brdf, brdf.sampler
            self.buffered: BufferedNetwork | None = None
            self.prepare_network(
                choice(properties, "weights", WEIGHTS),
                choice(properties, "precision", ("single", "half")) == "half",
            )
            if self.buffered is None:
                count_material()
            return 0 if brdf.isotropic else mi.BSDFFlags.Anisotropic

        def read(self, properties: Any) -> Brdf:
            from nacre.formats import load_brdf

            loaded: Brdf = load_brdf(material_path(properties))
            return loaded

        def prepare_network(self, weights: str, half: bool) -> None:
            """Decide which layers are compiled and which are data."""
            brdf = self.brdf
            if not isinstance(brdf, NetworkBrdf):
                if weights == "cooperative" or half:
                    raise NacreError(
                        f"weights and precision are for networks, not {type(brdf).__name__}"
                    )
                return
            jit = mi.Float is not float
            if weights == "cooperative" and not jit:
                raise NacreError(f"cooperative weights need a JIT variant, got {variant}")
            if not brdf.cooperative and weights == "cooperative":
                raise NacreError(
                    "cooperative weights cannot have the activations gelu and sin, or spectra"
                )
            literal = not jit or not brdf.cooperative
            start = len(brdf.layers) if literal else first_in_buffer(brdf, weights)
            if half and weights != "cooperative":
                raise NacreError("half precision is for cooperative weights")
            if start == len(brdf.layers):
                self.traced = without_inactive_units(brdf) if _prunes(brdf) else brdf
                return
            self.buffered = BufferedNetwork(brdf, mi, start, half)
            self.weights = self.buffered.initial()
            self.sampler = opaque(mi, brdf.sampler)

        def material(self) -> Brdf:
            brdf = self.brdf
            if self.buffered is None or not _is_its_layers(brdf):
                return brdf
            return brdf.with_layers(self.buffered.layers(self.weights))

        def at(self, si: Any, view: Components) -> tuple[None, Sampler]:
            return None, self.sampler

        def f_r(self, state: None, wi: Components, wo: Components) -> Components:
            if self.buffered is None:
                return self.traced.eval_components(wi, wo)
            return self.buffered.eval_components(self.weights, wi, wo)

        def spectrum(
            self, si: Any, state: None, wi: Components, wo: Components, cosine: Any, active: Any
        ) -> Any:
            brdf = self.brdf
            if not (mi.is_spectral and isinstance(brdf, SpectralBrdf)):
                return super().spectrum(si, state, wi, wo, cosine, active)
            coefficients = brdf.coefficients(wi, wo)
            wavelengths = adapter.components(*si.wavelengths)
            values = [brdf.at_wavelength(coefficients, w) * cosine for w in wavelengths]
            return adapter.unpolarized(mi, values, active)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            """The albedo along the normal, with the weights as loaded."""
            if self.albedo is None:
                red, green, blue = adapter.albedo(self.brdf).tolist()
                albedo = red, green, blue
                self.albedo = albedo if mi.Float is float else opaque(mi, albedo)
            return adapter.spectrum(mi, self.albedo, si.wavelengths, active)

        def traverse(self, callback: Any) -> None:
            if self.buffered is not None:
                callback.put("weights", self.weights, mi.ParamFlags.Differentiable)

        def describe(self) -> dict[str, Any]:
            facts = self.brdf.describe() | {"sampler": self.brdf.sampler}
            return facts if self.buffered is None else facts | {"weights": "cooperative"}

    class Network(Reflectance):
        """The plugin `nbrdf`."""

        def read(self, properties: Any) -> Brdf:
            brdf: Brdf = super().read(properties)
            if not isinstance(brdf, NetworkBrdf):
                raise NacreError(
                    f"nbrdf renders networks; for {type(brdf).__name__} use the plugin brdf"
                )
            return brdf

    return {"brdf": Reflectance, "nbrdf": Network}


@cache
def _called(variant: str) -> Any:
    """The class of BSDFs that call a function of another library."""
    mi: Any = require("mitsuba", "render")

    class Called(_plugins(variant)["brdf"]):  # type: ignore[misc]
        wavefront = True

        def prepare(self, properties: Any, brdf: WrappedBrdf) -> Any:
            if mi.Float is float:
                raise NacreError(f"functions of {brdf.library} need a JIT variant, got {variant}")
            self.brdf, self.buffered = brdf, None
            self.albedo: Components | None = None
            self.weights = None if brdf.parameters is None else mi.Float(brdf.parameters)
            self.sampler = opaque(mi, brdf.sampler)
            return 0 if brdf.isotropic else mi.BSDFFlags.Anisotropic

        def material(self) -> Brdf:
            brdf = self.brdf
            if self.weights is None:
                return brdf
            return brdf.with_parameters(np.array(self.weights, np.float32))

        def f_r(self, state: None, wi: Components, wo: Components) -> Components:
            red, green, blue = self.brdf.called(mi, self.weights, wi, wo)
            return red, green, blue

        def traverse(self, callback: Any) -> None:
            if self.weights is not None:
                callback.put("weights", self.weights, mi.ParamFlags.Differentiable)

    return Called


def _is_its_layers(brdf: Brdf) -> TypeGuard[NeuralBrdf | ChainBrdf]:
    """Whether a network can be made again from other layers."""
    return hasattr(brdf, "with_layers")


def _prunes(brdf: Brdf) -> TypeGuard[NeuralBrdf]:
    """Whether units that are never active can be left out."""
    return _is_its_layers(brdf) and not isinstance(brdf, ChainBrdf)
