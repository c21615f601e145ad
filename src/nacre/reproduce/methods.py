"""The representations that experiments compare, by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import Any

from nacre import analytic
from nacre.analytic import MODELS, AnalyticBrdf, AnisotropicGgx
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.latent.file import load_basis
from nacre.measured.rgl import RglBrdf, tabulate
from nacre.measured.rgl_writer import COMPACT
from nacre.neural import Recipe, fit
from nacre.neural.inputs import ENHANCED, STEREOGRAPHIC
from nacre.reproduce.trial import TRUTH, Method, Settings

GAIN = 16.0
"""Of the loss that analytic models are fitted with: fairer in pictures than the paper's 1."""


def _by_weights(kind: str, *hidden: tuple[int, int]) -> dict[str, tuple[int, int]]:
    """Widths of two hidden layers, of six inputs and three outputs, by their number of weights."""
    return {f"{kind}-{6 * a + a * b + 3 * b + (a + b + 3)}": (a, b) for a, b in hidden}


SIZES = _by_weights("nbrdf", *((n, n) for n in (6, 9, 13, 16, 21, 28, 36, 46)))
"""Hidden layers of the networks, by names that say their number of weights."""
ENHANCED_SIZES = _by_weights(
    "enhanced", (6, 6), (9, 9), (13, 12), (16, 16), (21, 21), (28, 28), (46, 46)
)
"""The same of networks of enhanced inputs, which take half as many bytes a weight."""


class UnavailableError(NacreError):
    """A method that has nothing for this material."""


def methods(
    settings: Settings, published: Iterable[Path] = (), basis: Path | None = None
) -> dict[str, Method]:
    """Every method by name.

    Networks in the folders `published` have the names of their materials; `basis` is of principal
    components of other materials (:class:`nacre.latent.PcaBasis`).
    """
    recipe = Recipe(epochs=settings.epochs, samples=settings.samples, seed=settings.seed)
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
            "network of enhanced inputs, hidden layers 21-21, trained three times as long",
            replace(enhanced, epochs=3 * recipe.epochs),
        ),
        "stereographic-685": _network(
            "network of the projected directions, as for textures, hidden layers 22-22",
            replace(recipe, hidden=(22, 22), inputs=STEREOGRAPHIC),
        ),
        "published": _published(tuple(published)),
        **models,
        "ggx-gain-1": _model(settings, "GGX, the paper's loss", MODELS["ggx"], 1.0),
        "rgl-48k": Method(
            "adaptive table of the RGL database, 48 KB",
            _table,
            "table",
            {"resolution": astuple(COMPACT)},
        ),
        "pca": _codes(basis),
    }


def _network(about: str, recipe: Recipe) -> Method:
    """An NBRDF."""
    chosen = {"recipe": asdict(recipe)}
    return Method(about, lambda brdf: fit(brdf, recipe), "network", chosen)


def _model(settings: Settings, about: str, model: type[AnalyticBrdf], gain: float) -> Method:
    options: dict[str, Any] = {"gain": gain, "seed": settings.seed}

    def fit_model(brdf: Brdf) -> Brdf:
        if brdf.isotropic and model is AnisotropicGgx:
            raise UnavailableError("is for anisotropic materials; on isotropic ones it is ggx")
        return analytic.fit(brdf, model, **options)

    return Method(about, fit_model, "analytic", {"model": model.model, **options})


def _published(folders: tuple[Path, ...]) -> Method:
    def find(brdf: Brdf) -> Brdf:
        name = f"{Path((brdf.source or {}).get('file', brdf.name)).stem}.h5"
        for folder in folders:
            if (folder / name).is_file():
                return load_brdf(folder / name)
        raise UnavailableError(f"no published network {name} in the folders given")

    about = "network that the authors published, hidden layers 21-21"
    # Of two folders with one name the first counts.
    files = [path for folder in reversed(folders) for path in sorted(folder.glob("*.h5"))]
    known = {path.name: digest(path) for path in files}
    return Method(about, find, "network", {"networks": known})


def _codes(path: Path | None) -> Method:
    basis = load_basis(path) if path else None

    def encode(brdf: Brdf) -> Brdf:
        if basis is None or basis.kind != "pca":
            raise UnavailableError("needs --basis, principal components of other materials")
        return basis.decode(basis.encode(brdf), brdf.name)

    values = f"{basis.code_dim} values" if basis else "values"
    about = f"code of {values} in a basis of principal components, refined for pictures"
    return Method(about, encode, "table", {"basis": basis.fingerprint() if basis else None})


def _table(brdf: Brdf) -> RglBrdf:
    if not brdf.isotropic:
        raise UnavailableError("48 KB hold no table of an anisotropic material")
    return tabulate(brdf, COMPACT)
