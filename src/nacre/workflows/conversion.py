"""Materials written in another format, and what that has lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, MissingExtraError
from nacre.formats import check_target, load_brdf, loses_bands, save, target, writer
from nacre.io.files import PathLike
from nacre.latent.estimates import bounds, plausible
from nacre.latent.intervals import DEVIATION
from nacre.measured.scattered import tabulate
from nacre.metrics.metrics import angular_errors
from nacre.runtime.progress import Progress, silent
from nacre.workflows.physical import Change, write_physical

if TYPE_CHECKING:
    from nacre.measured.textures.ubo2014.writer import Loss

_PAIRS = 1 << 14  # of directions, at which a table is compared with its source


@dataclass(frozen=True)
class Converted:
    """A written file, and how what is in it differs from the material."""

    path: Path
    median: float | None = None
    """Median relative difference of f_r, for a table; None where nothing is lost or known."""
    change: Change | None = None  # by `physical`
    colors_only: bool = False  # the material has spectra, the file their colors
    loss: Loss | None = None  # of a texture in a factored file


def convert_brdf(
    brdf: Brdf,
    output: PathLike,
    *,
    resolution: Sequence[int] | None = None,
    physical: bool = False,
) -> Converted:
    """Write a reflectance to the format that the file name ends in.

    Parameters
    ----------
    resolution
        Numbers of nodes of a table; the format's default where None.
    physical
        Make it reciprocal, and darken views that would reflect more light than they receive.

    Raises
    ------
    FormatError
        If no format with this ending can be written, not from this reflectance or not with this
        resolution, or the path cannot be written.
    NacreError
        As :func:`nacre.workflows.physical.write_physical`.
    """
    output = Path(output)
    write = checked_writer(output, resolution, physical)
    check_target(output, brdf)
    lost = brdf.wavelengths is not None and (
        physical or loses_bands(brdf, output, resolution is not None)
    )
    if physical:
        return Converted(output, None, write_physical(brdf, output, write), lost)
    write(_with_uncertainty(brdf, output), output)
    return Converted(output, _table_error(brdf, output), None, lost)


def _with_uncertainty(brdf: Brdf, output: Path) -> Brdf:
    """Samples with standard uncertainties, for files of samples, where plausible materials tell
    them; else the material as it is.
    """
    if not target(output).keeps_uncertainty or not plausible(brdf):
        return brdf
    scan = tabulate(brdf)
    pair = scan.samples.wi, scan.samples.wo
    low, high = bounds(brdf, *pair, DEVIATION)
    sigma = 0.5 * (high - low).mean(axis=1)
    return scan.with_samples(replace(scan.samples, sigma=sigma))


def checked_writer(output: Path, resolution: Sequence[int] | None, physical: bool) -> Any:
    """What writes the file; raises now what :func:`convert_brdf` would raise about its name."""
    if physical and target(output).holds:
        raise FormatError(f"{output}: for a physical network, use nacre fit --physical")
    return writer(output, resolution)


def convert_btf(
    texture: Btf,
    output: PathLike,
    *,
    precision: str | None = None,
    components: int | None = None,
    progress: Progress = silent,
) -> Converted:
    """Write a texture to the format that the file name ends in; options as :func:`nacre.save`."""
    options = {"precision": precision, "components": components}
    loss = save(texture, output, progress=progress, **options)
    return Converted(Path(output), loss=loss)


def _table_error(brdf: Brdf, output: Path) -> float | None:
    """What a table has lost by its resolution; None for other formats."""
    if target(output).resolution is None:
        return None
    try:
        found = angular_errors(brdf, load_brdf(output), _PAIRS)
    except MissingExtraError:  # reading needs a library that writing does not
        return None
    return found.relative_median if found.rmse_cosine > 0.0 else None
