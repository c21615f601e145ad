"""What Table 2 compares: codes of materials, from bases trained on most of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.latent.basis import LatentBasis
from nacre.latent.file import BASES, load_basis, save_basis
from nacre.latent.recipes import AutoencoderRecipe
from nacre.runtime.progress import Progress, named
from nacre_lab.reproduce.cache import Cache, cache_key, code_digest
from nacre_lab.reproduce.trial import Method, Settings

HELD_OUT = 0.2
"""Fraction of the materials held out."""
MIN_MATERIALS = 5
"""Least number of materials of which one can be held out."""


class Code(NamedTuple):
    """A kind of code: in words, the kind of its basis, and whether it is refined."""

    about: str
    kind: str
    refined: bool = True
    family: str = "network"


CODES: Mapping[str, Code] = {
    "pca-projected": Code("principal components, projected", "pca", False, "table"),
    "pca-refined": Code("principal components, refined for pictures", "pca", True, "table"),
    "autoencoder-projected": Code("the paper's autoencoder, encoder only", "autoencoder", False),
    "autoencoder-refined": Code("the paper's autoencoder, refined for pictures", "autoencoder"),
    "hypernetwork": Code("weights of a network, refined for pictures", "hypernetwork"),
    "neural": Code("functions that a network gives, refined for pictures", "neural"),
}
"""What Table 2 compares, by name."""


@dataclass(frozen=True)
class CodeSettings(Settings):
    """Settings shared by the trials of codes.

    Parameters
    ----------
    code_dim
        Number of values in a code.
    steps
        Largest number of training steps.
    mixtures
        Mixtures of two materials added to the training of the autoencoder.
    trained
        Number of materials used in training.
    predictors
        Whether bases also predict lobes for importance sampling.
    held_out
        File names of the held-out materials.
    """

    code_dim: int = 32
    steps: int = 8000
    mixtures: int = AutoencoderRecipe.mixtures
    trained: int = 0
    predictors: bool = False
    held_out: tuple[str, ...] = ()

    def quick(self) -> CodeSettings:
        """Settings of short trainings, for a first look."""
        return replace(self, steps=500, mixtures=60)

    def summary(self) -> str:
        """The settings in one line."""
        return (
            f"{self.pictures()}; codes of {self.code_dim} values; bases of the {self.trained} "
            f"materials that are not held out, trained for {self.steps:,} steps at most; seed "
            f"{self.seed}"
        )

    def recipe(self, kind: str) -> Any:
        """The recommended settings of a training, changed to these."""
        basis = BASES[kind]
        settings = {"code_dim": self.code_dim, "mixtures": self.mixtures, "seed": self.seed}
        known: dict[str, Any] = {field.name: field.default for field in fields(basis.Recipe)}
        settings["steps"] = min(self.steps, known.get("steps", 0))
        settings["predictors"] = self.predictors
        return basis.recipe({name: v for name, v in settings.items() if name in known})


def split(files: Sequence[Path], seed: int) -> tuple[list[Path], list[Path]]:
    """Training materials and held-out ones, independent of the given order."""
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
) -> tuple[dict[str, Method], CodeSettings]:
    """Methods of :data:`CODES` by name, and settings with the held-out materials.

    A random fifth of the isotropic materials in `files` is held out; bases for the others are
    trained if they are not in the cache, which also keeps the state of stopped trainings.

    Raises
    ------
    NacreError
        If a material cannot be read or is anisotropic, two have one name, there are too few, or a
        training fails.
    """
    if len({path.stem for path in files}) < len(files):
        raise NacreError("two materials have the same file name without its ending; rename one")
    if len(files) < MIN_MATERIALS:
        raise NacreError(f"table2 takes at least {MIN_MATERIALS} materials, got {len(files)}")
    training, held_out = split(files, settings.seed)
    settings = replace(
        settings, trained=len(training), held_out=tuple(path.stem for path in held_out)
    )
    found = bases(training, {CODES[name].kind for name in names}, settings, cache, progress)
    codes = {name: CODES[name] for name in names}
    return {k: _method(code, found[code.kind]) for k, code in codes.items()}, settings


def bases(
    training: Sequence[Path],
    kinds: Collection[str],
    settings: CodeSettings,
    cache: Cache,
    progress: Progress,
) -> dict[str, LatentBasis]:
    """Bases of isotropic materials by kind, trained if they are not in the cache.

    Raises
    ------
    NacreError
        If a material cannot be read or is anisotropic, or a training fails.
    """
    hashes = [digest(path) for path in training]
    materials = [partial(load_brdf, path) for path in training]
    found: dict[str, LatentBasis] = {}

    def basis(kind: str) -> LatentBasis:
        if kind in found:
            return found[kind]
        base = BASES[kind].builds_on
        built_on = basis(base) if base else None

        def make(state: Path) -> LatentBasis:
            return BASES[kind].train(
                materials,
                settings.recipe(kind),
                base=built_on,
                checkpoint=state,
                progress=named(progress, kind),
            )

        chosen = [settings.code_dim, settings.steps, settings.mixtures, settings.seed]
        chosen.append(settings.predictors)
        key = cache_key("basis", [kind, hashes, chosen, code_digest()])
        found[kind] = cache.file(key, load_basis, make, save_basis)
        return found[kind]

    return {kind: basis(kind) for kind in kinds}


def _method(code: Code, basis: LatentBasis) -> Method:
    def represent(brdf: Brdf) -> Brdf:
        return basis.decode(basis.encode(brdf, refine=code.refined), brdf.name)

    facts = {"basis": basis.fingerprint(), "refined": code.refined}
    return Method(code.about, represent, code.family, facts)
