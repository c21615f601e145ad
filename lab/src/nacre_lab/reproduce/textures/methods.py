"""Codecs by name, and how to find or train each."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from nacre.errors import NacreError
from nacre.formats import load_btf
from nacre.io.files import digest
from nacre.runtime.progress import Progress
from nacre.textures.codecs.basis.recipe import BasisRecipe
from nacre.textures.codecs.codec import CODECS, TexelCodec, TrainingRun
from nacre.textures.codecs.codec_file import PRETRAINED, load_codec
from nacre.textures.codecs.principal.analysis import PcaRecipe
from nacre.textures.codecs.principal.codec import find_components
from nacre_lab.reproduce.cache import module_digest
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.own_components import own_components

_COMPONENTS = 32
"""Number of components found at once, if possible; smaller codes use the first of them."""
_NAME = re.compile(r"([a-z0-9-]+?)-([1-9]\d{0,3})(?::([1-9])x([1-9]\d{0,3}))?")


@dataclass(frozen=True)
class TrainingSettings:
    """Settings shared by all trainings.

    Parameters
    ----------
    recipe
        Recipe of each network: one of :data:`nacre.textures.codecs.networks.recipe.RECIPES`.
    steps
        Training steps of each network, the same for all.
    epochs, minutes
        Instead of steps.
    device
        PyTorch device to train networks on.
    texels
        Texels of each material for general principal components.
    basis
        Recipe of nacre's own codec, except for the size of its codes.
    seed
        Seed of everything random.
    """

    recipe: str = "default"
    steps: int = 3000
    epochs: int | None = None
    minutes: float | None = None
    device: str = "cpu"
    texels: int = 100
    basis: BasisRecipe = field(default_factory=BasisRecipe)
    seed: int = 0

    @property
    def length(self) -> dict[str, float]:
        """Length of the training of networks, for their recipes."""
        if self.minutes is not None:
            return {"minutes": self.minutes}
        return {"steps": self.steps} if self.epochs is None else {"epochs": self.epochs}

    def describe(self) -> str:
        """The recipe and the length in words."""
        ((unit, count),) = self.length.items()
        return f"{self.recipe} recipe, {count:,g} {unit} a network"

    @classmethod
    def quick(cls, seed: int = 0) -> TrainingSettings:
        """Settings of short trainings, for a first look."""
        basis = BasisRecipe(texels=20, coded_texels=100, function_steps=400, code_steps=600)
        return cls(steps=300, texels=20, basis=basis, seed=seed)


@dataclass(frozen=True)
class Kind:
    """A kind of codec for texels.

    Parameters
    ----------
    about
        In words.
    recipe
        The settings that determine the codec of a method: JSON-able, or a dataclass of such.
    train
        Finds or trains the codec of a method with its recipe.
    sources
        Modules that determine the result, as patterns of paths.
    own
        Whether each material has its own codec.
    network
        Kind in :data:`CODECS` and settings of a trained network; None for other codecs.
    """

    about: str
    recipe: Callable[[Method, TrainingSettings], Any]
    train: Callable[[Method, TrainingRun, Any], TexelCodec]
    sources: tuple[str, ...]
    own: bool = False
    network: tuple[str, Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class Method:
    """A kind of codec, and the size of its codes.

    Parameters
    ----------
    kind
        One of :data:`KINDS`.
    code_dim
        Number of values in a code.
    decoder
        Widths of the hidden layers of a network's decoder; the paper's if empty.
    """

    kind: str
    code_dim: int
    decoder: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        """The name for :func:`find`."""
        sizes = f":{len(self.decoder)}x{self.decoder[0]}" if self.decoder else ""
        return f"{self.kind}-{self.code_dim}{sizes}"

    @property
    def own(self) -> bool:
        """Whether each material has a codec of its own."""
        return KINDS[self.kind].own

    def facts(self, training: Sequence[Material], settings: TrainingSettings) -> dict[str, Any]:
        """Everything that determines its codec, JSON-able."""
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
        """Find or train its codec; `state` is the prefix of files of a stopped training."""
        kind = KINDS[self.kind]
        journal = journal_path(state) if kind.network else None
        paths = [material.path for material in training]
        run = TrainingRun(paths, load_btf, state, journal=journal, progress=progress)
        return kind.train(self, run, kind.recipe(self, settings))


def journal_path(kept: Path) -> Path:
    """File for the losses of a training, beside a file of the same name."""
    return kept.with_suffix(".journal.csv")


def find(name: str) -> Method:
    """The method of a name such as `unified-32`, or `unified-32:4x106` for a network whose decoder
    has four hidden layers of 106.

    Raises
    ------
    NacreError
        If there is no such method.
    """
    match = _NAME.fullmatch(name)
    if match is None or match[1] not in KINDS or int(match[2]) > 1024:
        kinds = ", ".join(KINDS)
        raise NacreError(
            f"{name}: is not a method; expected one of {kinds} with a size, like unified-32"
        )
    if match[3] and KINDS[match[1]].network is None:
        raise NacreError(f"{name}: only networks have decoders of other sizes")
    return Method(match[1], int(match[2]), (int(match[4]),) * int(match[3]) if match[3] else ())


def _network_recipe(method: Method, settings: TrainingSettings) -> dict[str, Any]:
    network = KINDS[method.kind].network
    assert network is not None
    sizes = {"decoder_hidden": method.decoder} if method.decoder else {}
    return {
        "code_dim": method.code_dim,
        "preset": settings.recipe,
        "device": settings.device,
        "seed": settings.seed,
        **settings.length,
        **sizes,
        **network[1],
    }


def _train_network(method: Method, run: TrainingRun, settings: dict[str, Any]) -> TexelCodec:
    network = KINDS[method.kind].network
    assert network is not None
    kind = CODECS[network[0]]
    recipe = kind.recipe(**settings)
    if method.own:
        recipe = replace(recipe, training=replace(recipe.training, held_out=0.0))
    return kind.train(run, recipe)


def _pca_recipe(method: Method, settings: TrainingSettings) -> PcaRecipe:
    values = -(-method.code_dim // _COMPONENTS) * _COMPONENTS
    return PcaRecipe(values, settings.texels, seed=settings.seed)


def _find_components(method: Method, run: TrainingRun, recipe: PcaRecipe) -> TexelCodec:
    if method.own:
        return own_components(run.textures[0](), recipe.code_dim, recipe.seed)
    return find_components(run.textures, recipe, run.progress, min_count=1)


def _basis_recipe(method: Method, settings: TrainingSettings) -> BasisRecipe:
    try:
        return replace(settings.basis, code_dim=method.code_dim, seed=settings.seed)
    except ValueError as error:
        raise NacreError(f"{method.name}: {error}") from error


def _included(name: str, about: str, sources: tuple[str, ...]) -> Kind:
    """An included codec, unchanged."""
    path = PRETRAINED[name]
    return Kind(
        f"the included {about}, as it is",
        lambda *_: {"file": digest(path)},
        lambda *_: load_codec(path),
        sources,
    )


_CHOICES = (
    *("measured/textures/directions.py", "measured/textures/domes.py"),
    *("textures/selection.py", "textures/codecs/symmetry.py"),
    *("numerics/channels.py", "numerics/pca.py"),
)
_NETWORK = _network_recipe, _train_network, ("textures/codecs/networks/*.py", "numerics/muon.py")
_BASIS = "textures/codecs/basis/*.py", "numerics/mlp.py", "numerics/muon.py", *_CHOICES
_PCA = (
    _pca_recipe,
    _find_components,
    ("textures/codecs/principal/*.py", "reproduce/textures/own_components.py", *_CHOICES),
)
KINDS: Mapping[str, Kind] = {
    "unified": Kind(
        "network of Rainer et al. 2020 for all textures", *_NETWORK, network=("unified", {})
    ),
    "unified-max": Kind(
        "the same with max pooling", *_NETWORK, network=("unified", {"pooling": "max"})
    ),
    "unified-l2": Kind(
        "the same trained on squared errors", *_NETWORK, network=("unified", {"loss": "l2"})
    ),
    "custom": Kind(
        "network of Rainer et al. 2019, one per material",
        *_NETWORK,
        own=True,
        network=("custom", {}),
    ),
    "custom-all": Kind(
        "network of Rainer et al. 2019 for all textures", *_NETWORK, network=("custom", {})
    ),
    "pca": Kind("principal components of all textures", *_PCA),
    "pca-own": Kind("principal components of the material's own texels", *_PCA, own=True),
    "basis": Kind(
        "nacre's own codec",
        _basis_recipe,
        lambda _, run, recipe: CODECS["basis"].train(run, recipe),
        _BASIS,
    ),
    "included-unified": _included("unified", "network of Rainer et al. 2020", _NETWORK[-1]),
    "included-basis": _included("basis", "codec of nacre's own", _BASIS),
}
"""Every kind of method by name."""
