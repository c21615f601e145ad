"""The methods of the benchmark: every representation in nacre, and those from other packages."""

from __future__ import annotations

import tempfile
from dataclasses import asdict, replace
from pathlib import Path

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf, save
from nacre.included import names as included_names
from nacre.included import resolve
from nacre.latent.basis import LatentBasis
from nacre.latent.file import PRETRAINED, find_basis
from nacre.neural import Recipe, fit
from nacre.runtime.progress import Progress
from nacre_lab.benchmark import METHODS
from nacre_lab.benchmark.peers.closed_forms import closed_form_peers
from nacre_lab.benchmark.peers.networks import LARGE, networks
from nacre_lab.benchmark.protocol import GIVEN
from nacre_lab.benchmark.splits import Split
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.codes import CODES, Code, CodeSettings, bases
from nacre_lab.reproduce.methods import methods as compared
from nacre_lab.reproduce.trial import Method, Settings
from nacre_lab.reproduce.unseen import seen_by

_FILES = {
    ".bsdf": "table of the RGL database",
    ".binary": "table of the MERL database",
    ".mbsdf": "table of NVIDIA's MDL",
    ".xml": "tensor tree of Radiance",
    ".zemax.bsdf": "table of OpticStudio",
    ".anisotropicbsdf": "table of Speos, anisotropic",
    ".fred.txt": "table of FRED, luminance",
    ".ssdd": "table of libbsdf",
    ".bird.brdf": "samples of the metrology institutes' universal file",
    ".brdf": "table of Speos",
    ".xompt": "table of OpenMATERIAL 3D",
    ".bin": "table of the UTIA database",
}
"""Tables that nacre writes, by file ending."""

_REPLACED = "published", "pca"
"""Methods of :mod:`nacre_lab.reproduce` that need the user's files; here the wheel has them."""

SLOW = "texture-network-2019", "autoencoder-projected", "autoencoder-refined", LARGE
"""Methods that take minutes per material or to train a basis; they run only on request."""


class Bases:
    """Bases of codes that have seen none of a split's materials, made on request.

    The included basis of a kind is used if it has seen none of them; else one is trained on the
    split's training materials and cached.

    Parameters
    ----------
    split
        The split.
    folder
        Folder of the measured files of its database, if it has one.
    settings
        Settings of the protocol.
    cache
        Cache of trained bases.
    progress
        Called with the progress of trainings.
    """

    def __init__(
        self, split: Split, folder: Path | None, settings: Settings, cache: Path, progress: Progress
    ) -> None:
        self._split, self._folder, self._cache = split, folder, Cache(cache)
        self._progress = progress
        self._settings = CodeSettings(seed=settings.seed, trained=len(split.training))
        if settings.epochs < Settings.epochs:
            self._settings = self._settings.quick()
        self._found: dict[str, LatentBasis] = {}

    def __call__(self, kind: str) -> LatentBasis:
        """The basis of a kind.

        Raises
        ------
        NacreError
            If there are no materials to train on, one is missing, or the training fails.
        """
        if kind not in self._found:
            included = self._included(kind)
            if included is None and not self._split.training:
                raise NacreError(
                    f"{self._split.name}: have no other materials to learn codes from, and no "
                    f"included basis {kind!r} has seen none of them"
                )
            paths = [self._split.path(name, self._folder) for name in self._split.training]
            self._found[kind] = (
                included
                or (bases(paths, [kind], self._settings, self._cache, self._progress)[kind])
            )
        return self._found[kind]

    def facts(self, kind: str) -> dict[str, object]:
        """What determines the basis, JSON-able, without making it."""
        included = self._included(kind)
        if included is not None:
            return {"basis": included.fingerprint()}
        own = self._settings
        return {"basis": [kind, self._split.name, own.code_dim, own.steps, own.mixtures, own.seed]}

    def _included(self, kind: str) -> LatentBasis | None:
        if kind not in PRETRAINED:
            return None
        basis = find_basis(kind)
        materials = [Path(name.rpartition(":")[2]) for name in self._split.materials]
        return None if seen_by(basis, materials) else basis


def methods(settings: Settings, bases: Bases | None = None) -> dict[str, Method]:
    """Every method by name; without `bases`, those of codes can only be described.

    Raises
    ------
    NacreError
        If a method from another package does not load, or has the name of one of nacre's.
    """
    recipe = Recipe(epochs=settings.epochs, samples=settings.samples, seed=settings.seed)
    own = {name: m for name, m in compared(settings).items() if name not in _REPLACED}
    own |= {
        "enhanced-675-draft": _network(
            "nacre fit --preset draft",
            Recipe.preset("draft", samples=settings.samples, seed=settings.seed),
        ),
        "enhanced-675-best": _network(
            "nacre fit --preset best", replace(recipe, epochs=10 * settings.epochs)
        ),
        "physical-675": _network("nacre fit --physical", replace(recipe, physical=True)),
        "published": Method(
            "network that the authors published, in half precision",
            _published,
            "network",
            {GIVEN: "was fitted by its authors"},
        ),
        **networks(settings),
        **{name: _coded(code, bases) for name, code in CODES.items()},
        **closed_form_peers(settings),
        **{f"file{ending}": _file(ending, about) for ending, about in _FILES.items()},
    }
    for name in METHODS:
        if name in own:
            raise NacreError(f"there already is a method {name!r}; the package must rename its own")
    return own | {name: METHODS[name] for name in METHODS}


def find_methods(names: tuple[str, ...], known: dict[str, Method]) -> dict[str, Method]:
    """The named methods, or all but the slow ones.

    Raises
    ------
    NacreError
        If there is no such method; the message lists the known ones.
    """
    for name in names:
        if name not in known:
            raise NacreError(f"{name!r} is not a method (known: {', '.join(known)})")
    chosen = names or tuple(name for name in known if name not in SLOW)
    return {name: known[name] for name in chosen}


def _network(about: str, recipe: Recipe) -> Method:
    return Method(about, lambda brdf: fit(brdf, recipe), "network", {"recipe": asdict(recipe)})


def _published(brdf: Brdf) -> Brdf:
    """The published network for a measured RGL table, which comes with nacre."""
    file = Path((brdf.source or {}).get("file", ""))
    name = f"nbrdf-rgl:{file.stem.removesuffix('_rgb')}"
    if file.suffix != ".bsdf" or name not in included_names():
        raise NacreError("is for measured tables of the RGL database")
    return load_brdf(resolve(name))


def _coded(code: Code, bases: Bases | None) -> Method:
    def represent(brdf: Brdf) -> Brdf:
        assert bases is not None
        basis = bases(code.kind)
        return basis.decode(basis.encode(brdf, refine=code.refined), brdf.name)

    facts = {} if bases is None else bases.facts(code.kind)
    return Method(code.about, represent, code.family, {**facts, "refined": code.refined})


def _file(ending: str, about: str) -> Method:
    def written(brdf: Brdf) -> Brdf:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            path = Path(folder) / f"material{ending}"
            save(brdf, path)
            return load_brdf(path).replaced(name=brdf.name)

    return Method(f"{about}, as nacre convert writes it", written, "table", {"ending": ending})
