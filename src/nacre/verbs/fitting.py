"""`nacre.fit`: a network from a reflectance, codes from a texture, or an analytic model."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.files import PathLike
from nacre.neural.recipe import PRESETS, Recipe
from nacre.runtime.progress import Progress, silent
from nacre.verbs.material import Given, closest, opened, path_of

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity

_NETWORK = "nbrdf"
_SPECTRAL = "spectral"
_RECIPE = frozenset(field.name for field in fields(Recipe)) - {"size"}
_ANALYTIC = frozenset({"samples", "gain", "seed"})
_NETWORK_ONLY = ("preset", "max_bytes", "prior", "free_scale", "intervals", "device")
_TEXTURE_ONLY = (
    *("codec", "directions", "pixels", "texels_per_block"),
    *("bytes_per_texel", "quality"),
)


def fit(
    material: Given,
    recipe: Recipe | str | None = None,
    *,
    model: str | None = None,
    preset: str | None = None,
    max_bytes: int | None = None,
    prior: bool | None = None,
    free_scale: bool | None = None,
    intervals: bool | None = None,
    device: str | None = None,
    codec: PathLike | None = None,
    directions: PathLike | None = None,
    pixels: Quantity | None = None,
    texels_per_block: int | None = None,
    bytes_per_texel: float | None = None,
    quality: float | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Any:
    """Fit a neural material: a network to a reflectance, codes to a texture.

    The result is what `nacre fit` writes; :func:`nacre.save` writes it.

    Parameters
    ----------
    material
        A reflectance or a texture, its path, or the name of one that comes with nacre.
    recipe
        A :class:`nacre.Recipe`, or the name of a preset: "draft", "standard" or "best".
    model
        "spectral" for a network over wavelength, or one of :data:`nacre.analytic.MODELS` in place
        of a network.
    preset
        The same as its name in the place of `recipe`.
    max_bytes
        Size limit of the weights, in place of `hidden`: two layers as wide as it allows.
    prior
        Use what other materials are like when fitting up to 200 samples, and store how certain the
        result is; by default true.
    free_scale
        Also find one factor that scales all of up to 200 samples.
    intervals
        For a scan with uncertainties, also store what they mean for f_r.
    device
        PyTorch device, such as "cuda", in place of the compiled CPU kernel.
    codec
        Texture codec: "basis", "unified" or a file; nacre's own where None.
    directions, pixels
        Of a folder of images; see :func:`nacre.load`.
    texels_per_block
        Texels in memory at a time; 256 MB of values where None.
    bytes_per_texel, quality
        How many bytes the codes of a texture may take, 0.5 to 64, or with how many dB they are to
        keep what the codec makes of it, 10 to 80; see :class:`nacre.textures.limit.Rate`.
    progress
        Called as the fit goes on.
    settings
        Fields of :class:`nacre.Recipe`, such as `epochs=20`, `seed=1`, `hidden=(16, 16)` or
        `inputs="paper"`, on top of the recipe or preset. For a model: `samples`, `gain`, `seed`;
        for a texture: `precision`, "single" or "half".

    Returns
    -------
    NeuralBrdf, SpectralBrdf, AnalyticBrdf or NeuralBtf
        With its errors among the facts of :func:`nacre.info`.

    Raises
    ------
    TypeError
        If there is no such keyword, or it is for another kind of material; the message says which
        is meant.
    ValueError
        If there is no such preset, or a setting is out of range.
    NacreError
        If the material cannot be read or fitted.
    MissingExtraError
        If PyTorch is needed and not installed.

    Examples
    --------
    >>> import nacre
    >>> network = nacre.fit("rgl:paper_white", "draft", epochs=2, samples=4000)
    >>> network.sizes
    (6, 21, 21, 3)
    """
    path = path_of(material)
    if path is not None and path.is_dir() and directions is None:
        _refuse_library(path)
    found = opened(material, directions=directions, quantity=pixels)
    network = {"preset": preset, "max_bytes": max_bytes, "prior": prior, "free_scale": free_scale}
    network |= {"intervals": intervals, "device": device}
    texture: dict[str, Any] = {"codec": codec, "texels_per_block": texels_per_block}
    texture |= {"bytes_per_texel": bytes_per_texel, "quality": quality}
    if isinstance(found, Btf):
        _refuse({"recipe": recipe, "model": model, **network}, f"{found.name} is a texture")
        return _texture(found, texture, settings, progress or silent)
    _refuse(texture, f"{found.name or 'this material'} is a reflectance")
    if model not in (None, _NETWORK, _SPECTRAL):
        _refuse({"recipe": recipe, **network}, f"{model} is no network")
        return _analytic(found, model, settings, progress or silent)
    spectral = model == _SPECTRAL
    return _network(found, recipe, network, settings, progress or silent, spectral)


def _network(
    brdf: Brdf,
    recipe: Recipe | str | None,
    given: dict[str, Any],
    settings: dict[str, Any],
    progress: Progress,
    spectral: bool,
) -> Brdf:
    from nacre.workflows.fitting import NetworkFitting, SpectralFitting

    _check(settings, _RECIPE | {*_NETWORK_ONLY, "model"})
    if given["max_bytes"] is not None:
        settings = settings | {"size": given["max_bytes"]}
    if isinstance(recipe, Recipe):
        if given["preset"] is not None:
            raise TypeError("fit() takes a recipe or a preset; leave one out")
        chosen = replace(recipe, **settings) if settings else recipe
    else:
        if recipe is not None and given["preset"] is not None:
            raise TypeError("fit() takes one preset; leave one out")
        preset = Recipe.spectral if spectral else Recipe.preset
        chosen = preset(_preset(recipe or given["preset"] or "standard"), **settings)
    kept = {name: given[name] for name in ("prior", "free_scale", "intervals")}
    kept = {name: value for name, value in kept.items() if value is not None}
    fitting = (SpectralFitting if spectral else NetworkFitting)(chosen, given["device"], **kept)
    fitting.check()
    return fitting.fit(brdf, progress)


def _preset(name: object) -> str:
    """The name of a preset; raises ValueError or TypeError, which says what to write instead."""
    if not isinstance(name, str):
        what = type(name).__name__
        raise TypeError(f"fit() takes a nacre.Recipe or the name of a preset, got {what}")
    if name in PRESETS:
        return name
    if name in MODELS:
        raise ValueError(f"{name!r} is a model, not a preset: nacre.fit(..., model={name!r})")
    if Path(name).suffix:
        raise ValueError(
            f"{name!r} is no preset; to write the fit there: nacre.save(nacre.fit(...), {name!r})"
        )
    raise ValueError(f"{name!r} is no preset{closest(name, PRESETS)}")


def _analytic(brdf: Brdf, model: str, settings: dict[str, Any], progress: Progress) -> Brdf:
    from nacre.workflows.fitting import AnalyticFitting

    _check(settings, _ANALYTIC, f" of {model}")
    if model not in MODELS:
        raise NacreError(f"{model!r} is no model{closest(model, [_NETWORK, _SPECTRAL, *MODELS])}")
    return AnalyticFitting(MODELS[model], settings).fit(brdf, progress)


def _texture(
    texture: Btf,
    given: dict[str, Any],
    settings: dict[str, Any],
    progress: Progress,
) -> Btf:
    from nacre.textures.codecs.codec_file import PRETRAINED
    from nacre.textures.limit import Rate
    from nacre.workflows.encoding import encoded_texture

    _check(settings, frozenset({"precision", *_TEXTURE_ONLY}), " of a texture")
    precision = settings.get("precision", "single")
    if precision not in ("single", "half"):
        raise ValueError(f"precision must be one of single, half, got {precision!r}")
    rate = Rate.of(given["bytes_per_texel"], given["quality"])
    if rate is not None and "precision" in settings:
        raise TypeError("fit() takes a precision, or bytes per texel or a quality; leave one out")
    return encoded_texture(
        texture,
        model=PRETRAINED.get(str(given["codec"]), given["codec"]),
        half=precision == "half",
        rate=rate,
        texels_per_block=given["texels_per_block"],
        progress=progress,
    )


def _check(settings: dict[str, Any], known: frozenset[str], what: str = "") -> None:
    for name in settings:
        if name not in known:
            about = f"fit(){what} has no keyword {name!r}"
            raise TypeError(f"{about}{closest(name, sorted(known))}")


def _refuse(given: dict[str, Any], why: str) -> None:
    """Raise if a keyword for another kind of material is given."""
    for name, value in given.items():
        if value is not None:
            raise TypeError(f"fit() takes no {name} here: {why}")


def _refuse_library(folder: Path) -> None:
    from nacre.formats import describe_kind

    if not describe_kind(folder):
        raise NacreError(
            f"{folder}: is a folder; fit what is in it by nacre.workflows.fit_library, or "
            f"by the command: nacre fit {folder}"
        )
