"""Any reflectance as a material of one model, for file formats and tools that hold only that."""

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
    """The material itself if it is one of the model, else the model fitted to it.

    If the reflectance is anisotropic, the fit uses the variant that :data:`nacre.analytic.MODELS`
    lists as the model's name with "-anisotropic", if there is one. Progress is called during the
    fit.

    Raises
    ------
    NacreError
        If the model cannot be fitted.
    """
    if isinstance(brdf, model):
        return brdf
    if not brdf.isotropic:
        model = cast("type[Model]", MODELS.get(f"{model.model}-anisotropic", model))
    return analytic.fit(brdf, model, progress=progress).replaced(notes=brdf.notes)


def write_fitted(
    brdf: Brdf,
    model: type[Model],
    path: PathLike,
    encode: Callable[[Model], bytes],
    progress: Progress | None = None,
) -> None:
    """Write a reflectance, as :func:`fitted` returns it, to a file that holds one model.

    Raises FormatError if the path is bad, or the model cannot be fitted.
    """
    try:
        material = fitted(brdf, model, progress)
    except NacreError as error:
        raise FormatError(f"{path}: {error}") from error
    write_encoded(path, encode, material)
