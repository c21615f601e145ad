"""Table 2: codes of materials that were held out, by bases of the others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from nacre import latent
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load
from nacre.io.files import digest
from nacre.latent import (
    Autoencoder,
    AutoencoderRecipe,
    Basis,
    BasisRecipe,
    HypernetworkRecipe,
    encode,
)
from nacre.latent.file import AnyBasis, fingerprint, load_basis, save_basis
from nacre.render.sphere import lit_pixels
from nacre.reproduce.cache import Cache, cache_key, code_digest
from nacre.reproduce.trial import Method, Settings
from nacre.runtime.progress import Progress, named

HELD_OUT = 0.2
"""Fraction of the materials that is held out."""
MIN_MATERIALS = 5
"""Number of materials of which one can be held out."""


class Code(NamedTuple):
    """One way to give a material a code: in words, the kind of its basis, whether refined."""

    about: str
    model: str
    refined: bool = True


CODES: Mapping[str, Code] = {
    "pca-projected": Code("principal components, projected", "pca", False),
    "pca-refined": Code("principal components, refined for pictures", "pca"),
    "autoencoder-projected": Code("the paper's autoencoder, encoder only", "autoencoder", False),
    "autoencoder-refined": Code("the paper's autoencoder, refined for pictures", "autoencoder"),
    "hypernetwork": Code("weights of a network, refined for pictures", "hypernetwork"),
    "neural": Code("functions that a network gives, refined for pictures", "neural"),
}
"""What Table 2 compares, by name."""

_MODELS = ("pca", "autoencoder", "neural", "hypernetwork")
"""Of bases, in an order in which each can be made."""
_Recipe = TypeVar("_Recipe", BasisRecipe, HypernetworkRecipe, AutoencoderRecipe)


@dataclass(frozen=True)
class CodeSettings(Settings):
    """What the trials of codes share.

    Parameters
    ----------
    code_dim
        Numbers in a code.
    steps
        Of a training, at most.
    mixtures
        Mixtures of two materials that the autoencoder is trained on as well.
    trained
        Number of materials that the bases are trained on.
    """

    code_dim: int = 32
    steps: int = 8000
    mixtures: int = AutoencoderRecipe.mixtures
    trained: int = 0

    def summary(self) -> str:
        """The settings in one line, for people."""
        return (
            f"{self.pictures()}; codes of {self.code_dim} values; bases of {self.trained} "
            "materials other than those below, trained for "
            f"{self.steps:,} steps at most; seed {self.seed}"
        )

    def recipe(self, kind: type[_Recipe], **options: int) -> _Recipe:
        """The recommended settings of a training, with these in place of its own."""
        return kind(seed=self.seed, steps=min(self.steps, kind.steps), **options)


def split(files: Sequence[Path], seed: int) -> tuple[list[Path], list[Path]]:
    """Materials to train on, and held-out ones, whatever order they are given in."""
    files = sorted(files)
    order = np.random.default_rng(seed).permutation(len(files))
    held = round(HELD_OUT * len(files))
    return [files[i] for i in sorted(order[held:])], [files[i] for i in sorted(order[:held])]


def code_methods(
    files: Sequence[Path],
    names: Sequence[str],
    settings: CodeSettings,
    cache: Cache,
    progress: Progress,
) -> tuple[list[Path], dict[str, Method], CodeSettings]:
    """Train the bases that are not in the cache yet.

    Parameters
    ----------
    files
        Isotropic materials, of which a seeded fifth is held out.
    names
        Of :data:`CODES`.
    settings
        Of the trainings.
    cache
        Where bases are kept, and the state of trainings that were stopped.
    progress
        Called as it goes on.

    Returns
    -------
    held_out : list of Path
        Materials to try.
    methods : dict
        By name.
    settings : CodeSettings
        With the number of materials that were trained on.

    Raises
    ------
    NacreError
        If a material cannot be read or is anisotropic, two have one name, there are too few, or a
        training fails.
    """
    if len({path.stem for path in files}) < len(files):
        raise NacreError("two materials have the same file name without its ending; rename one")
    if len(files) < MIN_MATERIALS:
        raise NacreError(f"table2 takes {MIN_MATERIALS} materials at least, got {len(files)}")
    training, held_out = split(files, settings.seed)
    settings = replace(settings, trained=len(training))
    found = bases(training, {CODES[name].model for name in names}, settings, cache, progress)
    codes = {name: CODES[name] for name in names}
    return held_out, {k: _method(code, found[code.model]) for k, code in codes.items()}, settings


def bases(
    training: Sequence[Path],
    kinds: Collection[str],
    settings: CodeSettings,
    cache: Cache,
    progress: Progress,
) -> dict[str, AnyBasis]:
    """Bases of some materials by kind: those that are kept, and those that are trained now.

    Parameters
    ----------
    training
        Isotropic materials.
    kinds
        "pca", "autoencoder", "neural", "hypernetwork"; the last needs the neural one as well.
    settings, cache, progress
        See :func:`code_methods`.

    Raises
    ------
    NacreError
        If a material cannot be read or is anisotropic, or a training fails.
    """
    hashes = [digest(path) for path in training]
    materials = [partial(load, path) for path in training]
    found: dict[str, AnyBasis] = {}
    for kind in _MODELS:
        if kind not in kinds and not (kind == "neural" and "hypernetwork" in kinds):
            continue
        chosen = settings.code_dim, settings.steps, settings.mixtures, settings.seed
        facts = [kind, hashes, chosen, code_digest()]
        make = partial(_trained, kind, materials, found.get("neural"), settings, progress)
        found[kind] = cache.file(cache_key("basis", facts), load_basis, make, save_basis)
    return found


def _trained(
    model: str,
    materials: Sequence[Callable[[], Brdf]],
    neural: AnyBasis | None,
    settings: CodeSettings,
    progress: Progress,
    state: Path,
) -> AnyBasis:
    """A new basis; a hypernetwork is made of the neural one."""
    values, report = settings.code_dim, named(progress, model)
    recipe: Any
    basis: AnyBasis
    options: dict[str, Any] = {"checkpoint": state, "progress": report}
    if model == "pca":
        basis = latent.train(materials, values, progress=report)
    elif model == "autoencoder":
        recipe = settings.recipe(AutoencoderRecipe, values=values, mixtures=settings.mixtures)
        basis = latent.train_autoencoder(materials, lit_pixels(), recipe, **options)
    elif model == "neural":
        recipe = settings.recipe(BasisRecipe, values=values)
        basis = latent.train_neural(materials, recipe, **options)
    else:
        recipe = settings.recipe(HypernetworkRecipe)
        basis = latent.train_hypernetwork(neural, recipe, **options)
    return basis


def _method(code: Code, basis: AnyBasis) -> Method:
    def represent(brdf: Brdf) -> Brdf:
        if isinstance(basis, Basis | Autoencoder) and not code.refined:
            values = basis.project(brdf)
        else:
            values = encode(basis, brdf)
        decoded: Brdf = basis.decode(values, brdf.name)
        return decoded

    facts = {"basis": fingerprint(basis), "refined": code.refined}
    family = "table" if code.model == "pca" else "network"
    return Method(code.about, represent, family, facts)
