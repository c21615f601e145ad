"""The rows of a measurement, sorted out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import COLOR
from nacre.errors import FormatError
from nacre.measured.scattered import ScatteredBrdf
from nacre.spectra import as_channels

_IN_PLANE = 0.02  # sine of the angle to the plane of incidence that counts as in it
_AGREEMENT = 1.5  # ratio of samples of one pair that is worth a word


def from_measurement(
    wi: Floats,
    wo: Floats,
    rgb: Floats | None,
    name: str,
    *,
    where: str = "",
    isotropic: bool = True,
    spectra: Floats | None = None,
    wavelengths: Floats | None = None,
    sigma: Floats | None = None,
    apertures: Floats | None = None,
    bandwidth: float = 0.0,
    facts: Mapping[str, Any] | None = None,
    notes: Iterable[str] = (),
) -> ScatteredBrdf:
    """A reflectance from the rows of a file, which may hold more than a reflectance can.

    `apertures` are half angles of source and detector in radians, shape (n, 2) or (2,). Where `rgb`
    is None, its channels are those of the spectra
    (:func:`nacre.spectra.as_channels`).

    Samples with a direction at or below the horizon, and those negative in every channel (not
    measured), are left out. Samples of one pair of directions, to a millionth, are averaged; for an
    isotropic material, so are those that turning and mirroring the surface make one pair: they
    would hide how far samples are from each other. :meth:`ScatteredBrdf.describe` counts them. A
    :class:`FormatError`, which starts with `where`, says that nothing is left.
    """
    channels = COLOR
    if rgb is None:
        assert spectra is not None
        assert wavelengths is not None
        rgb, channels = as_channels(spectra, wavelengths)
    # A direction at 90 degrees comes out of the sine and cosine a rounding error above 0.
    visible = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    known = (rgb if spectra is None else spectra).max(axis=1) >= 0.0
    kept = visible & known
    if not kept.any():
        start = f"{where}: " if where else ""
        raise FormatError(f"{start}no sample is above the horizon and measured")
    pairs = np.concatenate([wi[kept], wo[kept]], axis=1)
    turned = _rotated(pairs) if isotropic else pairs
    keys = np.round(turned * 1e6).astype(np.int64)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))[group.reshape(-1)]  # in the order of the file
    first = np.sort(first)
    count = np.bincount(rank)[:, None]

    def mean(values: Floats) -> Floats:
        if len(first) == len(rank):
            return np.asarray(values[kept])
        total = np.zeros((len(first), values.shape[1]))
        np.add.at(total, rank, values[kept])
        return total / count

    def of_means(noise: Floats) -> Floats:
        """Standard deviations (n,) of means of what has those of `noise`."""
        return np.asarray(np.sqrt(mean(np.square(noise)[:, None]) / count)[:, 0])

    if apertures is not None and apertures.ndim == 2:
        apertures = mean(apertures)
    said = [*notes, *_cautions(turned, rgb[kept].max(axis=1), rank, isotropic)]
    counts = {
        "dropped below the horizon": int((~visible).sum()),
        "dropped as not measured": int((visible & ~known).sum()),
        "averaged as duplicates": int(kept.sum()) - len(first),
    }
    scan = ScatteredBrdf(
        wi[kept][first],
        wo[kept][first],
        mean(rgb),
        name,
        isotropic=isotropic,
        spectra=None if spectra is None else mean(spectra),
        wavelengths=wavelengths,
        sigma=None if sigma is None else of_means(sigma),
        apertures=apertures,
        bandwidth=bandwidth,
        facts=dict(facts or {}) | counts,
    )
    return scan.replaced(channels=channels, notes=tuple(said))


def _cautions(
    pairs: Floats, values: Floats, rank: npt.NDArray[np.int64], isotropic: bool
) -> Iterator[str]:
    """What to say of samples, pairs (n, 6) of directions with their values and groups (n,).

    Pairs of an isotropic material are :func:`_rotated`.
    """
    if isotropic and len(pairs) > 1 and np.abs(pairs[:, 4]).max() < _IN_PLANE:
        yield (
            "All samples lie in the plane of incidence: values across it are guesses; "
            "nacre estimate gives their bounds."
        )
    least, most = np.full(rank.max() + 1, np.inf), np.zeros(rank.max() + 1)
    np.minimum.at(least, rank, values)
    np.maximum.at(most, rank, values)
    several = (np.bincount(rank) > 1) & (most > 0.0)
    if not several.any():
        return
    ratio = most[several] / np.maximum(least[several], 1e-3 * most[several])
    if (large := float(np.quantile(ratio, 0.9))) > _AGREEMENT:
        yield (
            f"Samples of one pair of directions, which are averaged, differ: a tenth of them by "
            f"{large:.2g} times or more."
        )


def _rotated(pairs: Floats) -> Floats:
    """Pairs (n, 6) turned to the light's azimuth 0, or the viewer's under a light at the normal;
    the viewer's y comes without its sign, which mirroring changes.
    """
    light, view = pairs[:, :3], pairs[:, 3:]
    tilted = np.hypot(light[:, 0], light[:, 1]) > 1e-6
    x, y, _ = np.where(tilted, light.T, view.T)
    radius = np.hypot(x, y)
    cosine = np.divide(x, radius, out=np.ones_like(x), where=radius > 0.0)
    sine = np.divide(y, radius, out=np.zeros_like(y), where=radius > 0.0)
    turned = [
        (cosine * w[:, 0] + sine * w[:, 1], np.abs(cosine * w[:, 1] - sine * w[:, 0]), w[:, 2])
        for w in (light, view)
    ]
    return np.stack([*turned[0], *turned[1]], axis=1)
