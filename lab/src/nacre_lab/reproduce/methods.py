"""The representations that experiments compare, by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import Any

from nacre import analytic
from nacre.analytic import MODELS, AnalyticBrdf, AnisotropicGgx
from nacre.analytic.tables import materials
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.latent.file import load_basis
from nacre.measured.rgl import RglBrdf, tabulate
from nacre.measured.rgl_writer import Resolution
from nacre.neural import Recipe, fit
from nacre.neural.inputs import ENHANCED, PAPER, STEREOGRAPHIC
from nacre.sampling import fit_blinn_phong
from nacre_lab.reproduce.extracted import ExtractedMicrofacets
from nacre_lab.reproduce.texture_network import fit_texture_network
from nacre_lab.reproduce.trial import TRUTH, Method, Settings

GAIN = 16.0
"""Gain of the loss for analytic models: fairer in pictures than the paper's 1."""


def _by_weights(kind: str, *hidden: tuple[int, int]) -> dict[str, tuple[int, int]]:
    """Widths of two hidden layers between six inputs and three outputs, by number of weights."""
    return {f"{kind}-{6 * a + a * b + 3 * b + (a + b + 3)}": (a, b) for a, b in hidden}


SIZES = _by_weights("nbrdf", *((n, n) for n in (6, 9, 13, 16, 21, 28, 36, 46)))
"""Hidden layers of the networks, by names with their number of weights."""
ENHANCED_SIZES = _by_weights(
    "enhanced", (6, 6), (9, 9), (13, 12), (16, 16), (21, 21), (28, 28), (46, 46)
)
"""The same for networks with enhanced inputs, which take half as many bytes per weight."""


COMPACT = Resolution(1, 12, 17, 4, 32)
"""An isotropic table of 48 KB, as the NBRDF paper's Table 3 has it; the best of those tried."""
TEXTURE_NETWORK = "texture-network-2019"
"""Name of the slowest method by far, about a minute per material."""
PHONG_SAMPLED = "nbrdf-675-phong"
"""The paper's "NBRDF + PhongIS": a network, sampled with the two numbers of section 3.3."""


class UnavailableError(NacreError):
    """A method that cannot represent this material."""


def methods(
    settings: Settings, published: Iterable[Path] = (), basis: Path | None = None
) -> dict[str, Method]:
    """Every method by name.

    Networks in the folders `published` are named after their materials; each table of fits there is
    a method. `basis` has principal components of other materials (:class:`nacre.latent.PcaBasis`).

    Raises
    ------
    FormatError
        If a table of fits in the folders is damaged, or the basis cannot be read.
    """
    folders = tuple(published)
    recipe = Recipe(
        inputs=PAPER, epochs=settings.epochs, samples=settings.samples, seed=settings.seed
    )
    enhanced = replace(recipe, inputs=ENHANCED)
    networks = {
        name: _network(
            f"network{kind}, hidden layers {hidden[0]}-{hidden[1]}", replace(base, hidden=hidden)
        )
        for kind, base, sizes in (
            ("", recipe, SIZES),
            (" of enhanced inputs, half precision", enhanced, ENHANCED_SIZES),
        )
        for name, hidden in sizes.items()
    }
    models = {
        name: _model(settings, f"analytic model, loss gain {GAIN:g}", model, GAIN)
        for name, model in MODELS.items()
    }
    return {
        TRUTH: Method("the material itself", lambda brdf: brdf, "truth"),
        **networks,
        "nbrdf-675-adaptive": _network(
            "network, hidden layers 21-21, directions uniform in the Rusinkiewicz angles",
            replace(recipe, sampling="rusinkiewicz"),
        ),
        "nbrdf-675-uniform": _network(
            "network, hidden layers 21-21, directions uniform over the hemisphere",
            replace(recipe, sampling="hemisphere"),
        ),
        "enhanced-675-long": _network(
            "network with enhanced inputs, hidden layers 21-21, trained three times as long",
            replace(enhanced, epochs=3 * recipe.epochs),
        ),
        "stereographic-685": _network(
            "network with projected directions, as for textures, hidden layers 22-22",
            replace(recipe, hidden=(22, 22), inputs=STEREOGRAPHIC),
        ),
        TEXTURE_NETWORK: Method(
            "network of Rainer et al. 2019 for textures, one per material",
            lambda brdf: fit_texture_network(brdf, epochs=settings.epochs, seed=settings.seed),
            "network",
            {"epochs": settings.epochs, "seed": settings.seed},
        ),
        PHONG_SAMPLED: _phong_sampled(recipe),
        "published": _published(folders),
        **_published_fits(folders),
        **models,
        "ggx-gain-1": _model(settings, "GGX, the paper's loss", MODELS["ggx"], 1.0),
        "rgl-48k": Method(
            "adaptive table of the RGL database, 48 KB",
            _table,
            "table",
            {"resolution": astuple(COMPACT)},
        ),
        "power-iterations": Method(
            "microfacets by power iteration, sampled through their normals", _extracted, "table"
        ),
        "pca": _codes(basis),
    }


def _network(about: str, recipe: Recipe) -> Method:
    """An NBRDF."""
    chosen = {"recipe": asdict(recipe)}
    return Method(about, lambda brdf: fit(brdf, recipe), "network", chosen)


def _phong_sampled(recipe: Recipe) -> Method:
    def fit_both(brdf: Brdf) -> Brdf:
        if not brdf.isotropic:
            raise UnavailableError("is for isotropic materials")
        return fit(brdf, recipe).replaced(sampler=fit_blinn_phong(brdf))

    about = "network, hidden layers 21-21, sampled with a Blinn-Phong lobe and the cosine"
    return Method(about, fit_both, "network", {"recipe": asdict(recipe), "sampler": "phong"})


def _extracted(brdf: Brdf) -> Brdf:
    if not brdf.isotropic:
        raise UnavailableError("is for isotropic materials")
    return ExtractedMicrofacets(brdf)


def _model(settings: Settings, about: str, model: type[AnalyticBrdf], gain: float) -> Method:
    options: dict[str, Any] = {"gain": gain, "seed": settings.seed}

    def fit_model(brdf: Brdf) -> Brdf:
        if brdf.isotropic and model is AnisotropicGgx:
            raise UnavailableError("is for anisotropic materials; on isotropic ones it is ggx")
        return analytic.fit(brdf, model, **options)

    return Method(about, fit_model, "analytic", {"model": model.model, **options})


def _published(folders: tuple[Path, ...]) -> Method:
    def find(brdf: Brdf) -> Brdf:
        name = f"{_file_stem(brdf)}.h5"
        for folder in folders:
            if (folder / name).is_file():
                return load_brdf(folder / name)
        raise UnavailableError(f"no published network {name} in the folders given")

    about = "network that the authors published, hidden layers 21-21"
    # Of two folders with one name the first counts.
    files = [path for folder in reversed(folders) for path in sorted(folder.glob("*.h5"))]
    known = {path.name: digest(path) for path in files}
    return Method(about, find, "network", {"networks": known})


def _published_fits(folders: tuple[Path, ...]) -> dict[str, Method]:
    """A method for each table of fits in some folders, by file name."""
    # Of two folders with one name the first counts.
    paths = [path for folder in reversed(folders) for path in sorted(folder.glob("*.fit"))]
    return {f"published-{path.stem}": _published_table(path) for path in paths}


def _published_table(path: Path) -> Method:
    known, problem = materials(path), ""
    try:
        load_brdf(path, next(iter(known), None))
    except FormatError as error:  # a model that nacre does not read
        problem = str(error)

    def find(brdf: Brdf) -> Brdf:
        name = _file_stem(brdf)
        if problem or name not in known:
            raise UnavailableError(problem or f"{path}: no material of this name")
        return load_brdf(path, name)

    about = f"published parameters from {path.name}"
    return Method(about, find, "analytic", {"table": digest(path)})


def _file_stem(brdf: Brdf) -> str:
    """The name under which published fits to a material are found."""
    return Path((brdf.source or {}).get("file", brdf.name)).stem


def _codes(path: Path | None) -> Method:
    basis = load_basis(path) if path else None

    def encode(brdf: Brdf) -> Brdf:
        if basis is None or basis.kind != "pca":
            raise UnavailableError("needs --basis with principal components of other materials")
        return basis.decode(basis.encode(brdf), brdf.name)

    values = f"{basis.code_dim} values" if basis else "values"
    about = f"code of {values} in a basis of principal components, refined for pictures"
    return Method(about, encode, "table", {"basis": basis.fingerprint() if basis else None})


def _table(brdf: Brdf) -> RglBrdf:
    if not brdf.isotropic:
        raise UnavailableError("a table of an anisotropic material does not fit into 48 KB")
    return tabulate(brdf, COMPACT)
