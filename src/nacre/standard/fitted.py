"""Any reflectance as a material of one model, which is what a file format or tool can hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from nacre import analytic
from nacre.analytic import MODELS, AnalyticBrdf
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike, write_encoded
from nacre.runtime.progress import Progress

Model = TypeVar("Model", bound=AnalyticBrdf)


def fitted(brdf: Brdf, model: type[Model], progress: Progress | None = None) -> Model:
    """The material itself where it is one of the model, else the fit of the model to it.

    Parameters
    ----------
    brdf
        Any reflectance.
    model
        Class of the model; to anisotropic reflectance its variant is fitted that
        :data:`nacre.analytic.MODELS` has with "-anisotropic" behind the name, where there is one.
    progress
        Called as the fit goes on.

    Raises
    ------
    NacreError
        If the model cannot be fitted to it.
    """
    if isinstance(brdf, model):
        return brdf
    if not brdf.isotropic:
        model = cast("type[Model]", MODELS.get(f"{model.model}-anisotropic", model))
    return analytic.fit(brdf, model, progress=progress)


def write_fitted(
    brdf: Brdf,
    model: type[Model],
    path: PathLike,
    encode: Callable[[Model], bytes],
    progress: Progress | None = None,
) -> None:
    """Write a reflectance to a file of one model, as :func:`fitted` gives it.

    Raises FormatError if the path is bad, or the model cannot be fitted.
    """
    try:
        material = fitted(brdf, model, progress)
    except NacreError as error:
        raise FormatError(f"{path}: {error}") from error
    write_encoded(path, encode, material)
