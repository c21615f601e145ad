"""Codecs by name, and how each is found or trained."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from nacre.errors import NacreError
from nacre.formats import load_btf
from nacre.reproduce.cache import module_digest
from nacre.reproduce.textures.materials import Material
from nacre.runtime.progress import Progress
from nacre.textures.codecs.basis.recipe import BasisRecipe
from nacre.textures.codecs.codec import CODECS, TexelCodec, TrainingRun
from nacre.textures.codecs.principal import PcaRecipe, find_components

_COMPONENTS = 32
"""Of those that are found at once, where there are as many; fewer are the first of them."""
_NAME = re.compile(r"([a-z-]+?)-([1-9]\d{0,3})")


@dataclass(frozen=True)
class TrainingSettings:
    """What all trainings share.

    Parameters
    ----------
    minutes
        Of the training of each network.
    texels
        Of each material, for general principal components.
    basis
        Of nacre's own codec, but for the size of its codes.
    seed
        Of everything random.
    """

    minutes: float = 10.0
    texels: int = 100
    basis: BasisRecipe = field(default_factory=BasisRecipe)
    seed: int = 0

    @classmethod
    def quick(cls, seed: int = 0) -> TrainingSettings:
        """Short trainings: figures to look at."""
        basis = BasisRecipe(texels=20, coded_texels=100, function_steps=400, code_steps=600)
        return cls(0.5, 20, basis, seed)


@dataclass(frozen=True)
class Kind:
    """A way to code texels.

    Parameters
    ----------
    about
        In words.
    recipe
        All of the settings that decides the codec of a method: JSON-able, or a dataclass that is.
    train
        Finds or trains the codec of a method by its recipe.
    sources
        Modules of nacre that decide the result, as patterns of paths.
    own
        Whether each material has a codec of its own.
    """

    about: str
    recipe: Callable[[Method, TrainingSettings], Any]
    train: Callable[[Method, TrainingRun, Any], TexelCodec]
    sources: tuple[str, ...]
    own: bool = False


@dataclass(frozen=True)
class Method:
    """A kind of codec, and the size of its codes.

    Parameters
    ----------
    kind
        One of :data:`KINDS`.
    code_dim
        Numbers in a code.
    """

    kind: str
    code_dim: int

    @property
    def name(self) -> str:
        """The name, as :func:`find` takes it."""
        return f"{self.kind}-{self.code_dim}"

    @property
    def own(self) -> bool:
        """Whether each material has a codec of its own."""
        return KINDS[self.kind].own

    def facts(self, training: Sequence[Material], settings: TrainingSettings) -> dict[str, Any]:
        """All that decides its codec, JSON-able."""
        kind = KINDS[self.kind]
        recipe = kind.recipe(self, settings)
        return {
            "kind": self.kind,
            "textures": [material.fingerprint for material in training],
            "settings": recipe if isinstance(recipe, dict) else asdict(recipe),
            "code": module_digest(*kind.sources),
        }

    def train(
        self,
        training: Sequence[Material],
        settings: TrainingSettings,
        state: Path,
        progress: Progress,
    ) -> TexelCodec:
        """Find or train its codec; `state` begins the names of files of a training that stops."""
        kind = KINDS[self.kind]
        run = TrainingRun([m.path for m in training], load_btf, state, progress=progress)
        return kind.train(self, run, kind.recipe(self, settings))


def find(name: str) -> Method:
    """The method of a name like `unified-32`.

    Raises
    ------
    NacreError
        If there is no such method.
    """
    match = _NAME.fullmatch(name)
    if match is None or match[1] not in KINDS or int(match[2]) > 1024:
        kinds = ", ".join(KINDS)
        raise NacreError(f"{name}: is no method; a name is one of {kinds}, and values: unified-32")
    return Method(match[1], int(match[2]))


def _network_recipe(method: Method, settings: TrainingSettings) -> dict[str, Any]:
    return {"code_dim": method.code_dim, "minutes": settings.minutes, "seed": settings.seed}


def _train_network(method: Method, run: TrainingRun, settings: dict[str, Any]) -> TexelCodec:
    kind = CODECS["unified" if method.kind == "unified" else "custom"]
    recipe = kind.recipe(**settings)
    if method.own:
        recipe = replace(recipe, training=replace(recipe.training, held_out=0.0))
    return kind.train(run, recipe)


def _pca_recipe(method: Method, settings: TrainingSettings) -> PcaRecipe:
    values = -(-method.code_dim // _COMPONENTS) * _COMPONENTS
    if method.own:
        return PcaRecipe.own(values, seed=settings.seed)
    return PcaRecipe(values, settings.texels, seed=settings.seed)


def _basis_recipe(method: Method, settings: TrainingSettings) -> BasisRecipe:
    try:
        return replace(settings.basis, code_dim=method.code_dim, seed=settings.seed)
    except ValueError as error:
        raise NacreError(f"{method.name}: {error}") from error


_CHOICES = (
    *("measured/textures/directions.py", "measured/textures/domes.py"),
    *("textures/selection.py", "textures/codecs/symmetry.py"),
    *("numerics/channels.py", "numerics/pca.py"),
)
_NETWORK = _network_recipe, _train_network, ("textures/codecs/networks/*.py",)
_PCA = (
    _pca_recipe,
    lambda _, run, recipe: find_components(run.textures, recipe, run.progress, min_count=1),
    ("textures/codecs/principal/*.py", *_CHOICES),
)
KINDS: Mapping[str, Kind] = {
    "unified": Kind("network of Rainer et al. 2020 for all textures", *_NETWORK),
    "custom": Kind("network of Rainer et al. 2019, one a material", *_NETWORK, own=True),
    "custom-all": Kind("network of Rainer et al. 2019 for all textures", *_NETWORK),
    "pca": Kind("principal components of all textures", *_PCA),
    "pca-own": Kind("principal components of the material's own texels", *_PCA, own=True),
    "basis": Kind(
        "nacre's own codec",
        _basis_recipe,
        lambda _, run, recipe: CODECS["basis"].train(run, recipe),
        ("textures/codecs/basis/*.py", "numerics/mlp.py", *_CHOICES),
    ),
}
"""Every kind of method by name."""
