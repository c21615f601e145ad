"""One material of every kind that nacre has, and of every real file that is there."""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import nacre
from nacre.array import Components
from nacre.brdf import Brdf
from nacre.latent import PcaBasis, PcaRecipe
from nacre.measured import MbsdfBrdf, ScatteredBrdf, bird, radiance, rgl, rgl_tables, utia
from nacre.measured.klems import BASES, KlemsBrdf
from nacre.measured.merl import Resolution, tabulate
from nacre.measured.polarized import PolarizedBrdf
from nacre.measured.rgl import RglBrdf
from nacre.mitsuba.functions import FormulaBrdf
from nacre.neural import Layer, NeuralBrdf
from nacre.neural.chain import ChainBrdf
from nacre.neural.inputs import (
    ENHANCED,
    PAPER,
    RECIPROCAL,
    SPINNING,
    STEREOGRAPHIC,
    has_axes,
    input_count,
)
from nacre.numerics.mlp import RELU, SQUARED_RELU
from nacre.sampling import fit_lobes
from nacre.sampling.projection import Projection
from nacre.textures.uniform import TexelBrdf
from tests.analytic.materials import EXAMPLES
from tests.contracts.directions import pairs
from tests.data import list_data, require_data
from tests.latent.made import random_autoencoder, random_basis, random_hypernetwork
from tests.measured.support import material, spectral, tensor_bytes
from tests.mitsuba.reflectances import Tilted
from tests.spectra import spectral_network
from tests.textures.codecs.basis.made import codec


@functools.cache
def network(isotropic: bool, inputs: str = PAPER) -> NeuralBrdf:
    """Of random weights, with lobes fitted to it."""
    random = np.random.default_rng(0)
    sizes = (input_count(inputs, isotropic), 21, 21, 3)
    layers = [
        Layer(random.normal(0, 0.4, (a, b)).astype(np.float32), np.full(b, 0.05, np.float32))
        for a, b in itertools.pairwise(sizes)
    ]
    brdf = NeuralBrdf(
        layers,
        isotropic=isotropic,
        name="random",
        inputs=inputs,
        activation=SQUARED_RELU if inputs == ENHANCED else RELU,
        angle=0.5 if has_axes(inputs, isotropic) else 0.0,
    )
    return brdf.replaced(sampler=fit_lobes(brdf))


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="nacre-contracts-")


def _path(name: str) -> Path:
    return Path(_folder().name) / name


def chain() -> ChainBrdf:
    random = np.random.default_rng(4)
    layers = [
        Layer(0.5 * random.normal(size=size), 0.1 * random.normal(size=size[1]))
        for size in ((6, 12), (12, 8), (8, 3))
    ]
    return ChainBrdf(layers, ("silu", "leaky relu 0.2", "softplus 3.0"), name="others")


def _formula(wi: Components, wo: Components) -> Components:
    return 0.1 + 0.1 * wi[2] * wo[2], 0.2 + 0.0 * wi[0], 0.3 * wi[2] * wo[2]


def rgl_table(phi_i: tuple[float, ...]) -> RglBrdf:
    """A table of smooth random numbers over the azimuths of the view."""
    path = _path(f"synthetic-{len(phi_i)}.bsdf")
    path.write_bytes(tensor_bytes(material(phi_i)))
    return RglBrdf(rgl_tables.read_tables(path))


def spectral_table() -> RglBrdf:
    """A table of spectra."""
    path = _path("synthetic_spec.bsdf")
    path.write_bytes(tensor_bytes(spectral(material([0.0]))))
    return rgl.load(path)


def tensor_trees(isotropic: bool) -> Brdf:
    """What Radiance reads, of a network."""
    path = _path(f"trees-{isotropic}.xml")
    radiance.save(network(isotropic), path, radiance.Resolution(8))
    return radiance.load(path)


def mbsdf_table() -> MbsdfBrdf:
    """Cells of random numbers."""
    return MbsdfBrdf(np.random.default_rng(0).random((5, 5, 7, 3), dtype=np.float32))


def klems_matrix() -> KlemsBrdf:
    """Patches of random numbers."""
    basis = BASES["LBNL/Klems Quarter"]
    shape = basis.patches, basis.patches, 3
    return KlemsBrdf(np.random.default_rng(0).random(shape, dtype=np.float32), basis, basis)


def polarized_table() -> PolarizedBrdf:
    """Nodes of random numbers, at half a turn."""
    nodes = [np.linspace(0.0, end, count) for end, count in ((math.pi, 5), (1.57, 4), (1.57, 4))]
    spectra = np.random.default_rng(0).random((5, 4, 4, 3), dtype=np.float32)
    return PolarizedBrdf(*nodes, spectra, [450.0, 550.0, 650.0])


def bird_scan() -> Brdf:
    """A scan with what its file says beside the samples."""
    path = _path("scan.bird.brdf")
    bird.save(scan(network(True)), path)
    return bird.load(path)


def scan(brdf: Brdf) -> ScatteredBrdf:
    """Samples of a reflectance at random directions."""
    wi, wo = pairs(1000)
    return ScatteredBrdf(wi, wo, brdf.eval(wi, wo), isotropic=brdf.isotropic)


def code() -> Brdf:
    """Half-way between two networks."""
    makers = [functools.partial(network, True, inputs) for inputs in (PAPER, ENHANCED)]
    return PcaBasis.train(makers, PcaRecipe(1, Resolution(30, 15, 15))).decode([0.0])


def _real(folder: str, name: str) -> Callable[[], Brdf]:
    return lambda: nacre.load(require_data(folder, name))


CODE = np.linspace(-1.0, 1.0, 6)
ANISOTROPIC = (-math.pi, -math.pi / 2, 0.0, 1.5, math.pi)

MATERIALS: dict[str, Callable[[], Brdf]] = {
    "isotropic network": lambda: network(True),
    "anisotropic network": lambda: network(False),
    "isotropic network of enhanced inputs": lambda: network(True, ENHANCED),
    "anisotropic network of enhanced inputs": lambda: network(False, ENHANCED),
    "network of spinning inputs": lambda: network(False, SPINNING),
    "physical network": lambda: network(True, RECIPROCAL),
    "anisotropic physical network": lambda: network(False, RECIPROCAL),
    "network of stereographic inputs": lambda: network(False, STEREOGRAPHIC),
    "network of others": chain,
    "spectral network": spectral_network,
    "formula": lambda: FormulaBrdf(_formula, isotropic=True, name="formula"),
    "PCA code": code,
    "code of a neural basis": lambda: random_basis().decode(CODE),
    "code of an autoencoder": lambda: random_autoencoder().decode(CODE),
    "code of a hypernetwork": lambda: random_hypernetwork().decode(CODE),
    "code of a texel": lambda: TexelBrdf(np.float32([0.3, -0.2]), codec(), "texel"),
    "MERL table of a network": lambda: tabulate(network(True), Resolution(30, 15, 15)),
    "UTIA table of a network": lambda: utia.tabulate(network(False)),
    "RGL table of a network": lambda: rgl.tabulate(network(True)),
    "MDL table": mbsdf_table,
    "Klems matrix": klems_matrix,
    "polarized table": polarized_table,
    "scan of a universal BRDF file": bird_scan,
    "isotropic RGL table": lambda: rgl_table((0.0,)),
    "anisotropic RGL table": lambda: rgl_table(ANISOTROPIC),
    "spectral RGL table": spectral_table,
    "tensor trees": lambda: tensor_trees(True),
    "anisotropic tensor trees": lambda: tensor_trees(False),
    "isotropic scattered samples": lambda: scan(network(True)),
    "anisotropic scattered samples": lambda: scan(network(False)),
    "projection": lambda: Projection(Tilted(0.1, 0.2, 0.3)),
    **{name: lambda example=example: example for name, example in EXAMPLES.items()},
    **{name: _real("rgl", name) for name in list_data("rgl", "*.bsdf")},
    **{name: _real("cornell", name) for name in list_data("cornell", "*.brdf")},
    **{
        name: _real("pretrained/merl", name)
        for name in ("chrome.h5", "pink-fabric.h5", "specular-black-phenolic.h5")
    },
}
"""By name; a maker skips the calling test where its file or library is absent."""


_LIKE_OTHERS = {
    *("isotropic network of enhanced inputs", "anisotropic physical network"),
    *("network of stereographic inputs", "code of a hypernetwork", "isotropic RGL table"),
    *("UTIA table of a network", "RGL table of a network", "anisotropic tensor trees"),
    *("scan of a universal BRDF file", "isotropic scattered samples"),
    *("chrome.h5", "specular-black-phenolic.h5"),
    *(name for name in EXAMPLES if name.endswith("anisotropic") or name.startswith("disney")),
    *list_data("rgl", "*.bsdf")[1:],
    *list_data("cornell", "*.brdf")[1:],
}
FEW = [name for name in MATERIALS if name not in _LIKE_OTHERS]
"""One of each kind, for the first tier of tests."""


@functools.cache
def made(name: str) -> Brdf:
    """One of :data:`MATERIALS`, the same object each time."""
    return MATERIALS[name]()
