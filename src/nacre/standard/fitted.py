"""Any reflectance as a material of one model, which is what a file format or tool can hold."""

from __future__ import annotations

from typing import TypeVar

from nacre import analytic
from nacre.analytic import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.runtime.progress import Progress

Model = TypeVar("Model", bound=AnalyticBrdf)


def fitted(
    brdf: Brdf,
    model: type[Model],
    progress: Progress | None = None,
    *,
    anisotropic: type[Model] | None = None,
) -> Model:
    """The material itself where it is one of the model, else the fit of the model to it.

    Parameters
    ----------
    brdf
        Any reflectance.
    model
        Class of the model.
    progress
        Called as the fit goes on.
    anisotropic
        Subclass that is fitted to anisotropic reflectance, where there is one.

    Raises
    ------
    NacreError
        If the model cannot be fitted to it.
    """
    if isinstance(brdf, model):
        return brdf
    if anisotropic is not None and not brdf.isotropic:
        model = anisotropic
    return analytic.fit(brdf, model, progress=progress)
