"""The fit of one material, from the measured file to the content of the fitted one."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from nacre.brdf import Brdf
from nacre.errors import NacreError, is_shortage, printable, reason
from nacre.formats import load_brdf
from nacre.metrics.comparison import directional_psnr
from nacre.runtime.progress import Progress
from nacre.workflows.fitting import Fitting


@dataclass(frozen=True)
class Fit:
    """The fit of one material, or the error that prevented it."""

    content: bytes = b""  # of the fitted file
    sha256: str | None = None  # of the measured file, in hexadecimal
    losses: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    error: str | None = None
    summary: str = ""  # the fit in one line
    notes: tuple[str, ...] = ()  # of the material
    psnr: float | None = None  # of spheres in directional light, in dB, if compared


def fit_file(path: Path, fitting: Fitting, progress: Progress) -> Fit:
    """Fit one measured file without writing anything.

    Errors become text, because an exception would keep the material alive through its frames.
    """
    try:
        progress("reading", 0, 1, "")
        brdf = load_brdf(path)
        start = time.perf_counter()
        fitted = fitting.fit(brdf, progress)
        seconds = time.perf_counter() - start
        fit = finished(fitting, fitted, (brdf.source or {}).get("sha256"), seconds)
        # What is known at scattered directions only has no sphere to compare with.
        known = brdf.scattered() is None
        return replace(fit, psnr=directional_psnr(brdf, fitted)) if known else fit
    except Exception as error:
        return Fit(error=explain(error, path))


def finished(fitting: Fitting, fitted: Brdf, sha256: str | None, seconds: float) -> Fit:
    """The outcome of a fit that took so many seconds; a NacreError if it cannot be written."""
    content, losses = fitting.encode(fitted), fitting.losses(fitted)
    summary = fitting.summary(fitted)
    return Fit(content, sha256, losses, round(seconds, 3), summary=summary, notes=fitted.notes)


def explain(error: Exception, path: Path) -> str:
    """What went wrong with a measured file, in one line without its name."""
    if isinstance(error, NacreError):
        text = str(error).removeprefix(f"{printable(str(path))}: ")
    elif is_shortage(error):
        text = "out of memory"
    elif isinstance(error, OSError):
        where = f"{os.fspath(error.filename)}: " if error.filename else ""
        text = f"{where}{error.strerror or error}"
    else:
        text = f"{type(error).__name__}: {reason(error)}"
    return printable(text)
