"""Table 2: codes of materials that were held out, by bases of the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from nacre import latent
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
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
from nacre.reproduce.cache import code_digest, facts_digest
from nacre.reproduce.methods import Method
from nacre.reproduce.trial import Settings
from nacre.runtime.progress import Progress, named

SHARE = 0.2
"""Of the materials that is held out."""
FEWEST = 5
"""Materials of which one can be held out."""


class Code(NamedTuple):
    """One way to give a material a code: in words, the model of its basis, whether optimized."""

    about: str
    model: str
    optimised: bool = True


CODES: Mapping[str, Code] = {
    "pca-projected": Code("principal components, projected", "pca", False),
    "pca-optimised": Code("principal components, optimized for pictures", "pca"),
    "autoencoder-projected": Code("the paper's autoencoder, encoder only", "autoencoder", False),
    "autoencoder-optimised": Code("the paper's autoencoder, optimized for pictures", "autoencoder"),
    "hypernetwork": Code("weights of a network, optimized for pictures", "hypernetwork"),
    "neural": Code("functions that a network gives, optimized for pictures", "neural"),
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
    values
        Of a code.
    steps
        Of a training, at most.
    mixtures
        Of two materials, that the autoencoder is trained on besides.
    trained
        Number of materials that the bases are trained on.
    """

    values: int = 32
    steps: int = 8000
    mixtures: int = AutoencoderRecipe.mixtures
    trained: int = 0

    def summary(self) -> str:
        """The settings in one line, for people."""
        return (
            f"{self.pictures()}; codes of {self.values} values; bases of {self.trained} materials "
            f"other than those below, trained for {self.steps:,} steps at most; seed {self.seed}"
        )

    def recipe(self, kind: type[_Recipe], **options: int) -> _Recipe:
        """The recommended settings of a training, with these in place of its own."""
        return kind(seed=self.seed, steps=min(self.steps, kind.steps), **options)


def split(files: Sequence[Path], seed: int) -> tuple[list[Path], list[Path]]:
    """Materials to train on, and held-out ones, whatever order they are given in."""
    files = sorted(files)
    order = np.random.default_rng(seed).permutation(len(files))
    held = round(SHARE * len(files))
    return [files[i] for i in sorted(order[held:])], [files[i] for i in sorted(order[:held])]


def code_methods(
    files: Sequence[Path],
    names: Sequence[str],
    settings: CodeSettings,
    folder: Path,
    progress: Progress,
    *,
    fresh: bool = False,
) -> tuple[list[Path], dict[str, Method], CodeSettings]:
    """Train the bases that are not in the folder yet, or all.

    Parameters
    ----------
    files
        Isotropic materials, of which a seeded fifth is held out.
    names
        Of :data:`CODES`.
    settings
        Of the trainings.
    folder
        Where bases are kept, and the state of trainings that were stopped; made if need be.
    progress
        Called as it goes on.
    fresh
        Whether to train again what is in the folder.

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
    if len(files) < FEWEST:
        raise NacreError(f"table2 takes {FEWEST} materials at least, got {len(files)}")
    training, held_out = split(files, settings.seed)
    settings = replace(settings, trained=len(training))
    hashes = [digest(path) for path in training]
    materials = [partial(load_brdf, path) for path in training]
    bases: dict[str, AnyBasis] = {}
    wanted = {CODES[name].model for name in names}
    for model in _MODELS:
        if model not in wanted and not (model == "neural" and "hypernetwork" in wanted):
            continue
        chosen = settings.values, settings.steps, settings.mixtures, settings.seed
        facts = [model, hashes, chosen, code_digest()]
        path = folder / f"basis-{facts_digest(facts)}.safetensors"
        found = None if fresh else _kept(path)
        if found is None:
            state = path.with_suffix(".state")
            if fresh:
                state.unlink(missing_ok=True)
            folder.mkdir(parents=True, exist_ok=True)
            report = named(progress, model)
            found = _trained(model, materials, bases.get("neural"), settings, state, report)
            save_basis(found, path)
            state.unlink(missing_ok=True)
        bases[model] = found
    codes = {name: CODES[name] for name in names}
    return held_out, {k: _method(code, bases[code.model]) for k, code in codes.items()}, settings


def _kept(path: Path) -> AnyBasis | None:
    """A basis that was trained before; None where there is none, or a damaged one."""
    try:
        return load_basis(path)
    except NacreError:
        return None


def _trained(
    model: str,
    materials: Sequence[Callable[[], Brdf]],
    neural: AnyBasis | None,
    settings: CodeSettings,
    state: Path,
    report: Progress,
) -> AnyBasis:
    """A new basis; a hypernetwork is made of the neural one."""
    values = settings.values
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
        if isinstance(basis, Basis | Autoencoder) and not code.optimised:
            values = basis.project(brdf)
        else:
            values = encode(basis, brdf)
        decoded: Brdf = basis.decode(values, brdf.name)
        return decoded

    facts = {"basis": fingerprint(basis), "optimised": code.optimised}
    family = "table" if code.model == "pca" else "network"
    return Method(code.about, represent, family, facts)
