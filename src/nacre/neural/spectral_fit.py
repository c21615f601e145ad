"""From a reflectance with spectra to a spectral network."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from nacre.array import Doubles, Floats
from nacre.brdf import Brdf, expect_brdf
from nacre.errors import NacreError
from nacre.neural.augmentation import augmentation
from nacre.neural.broad_bands import BroadBands
from nacre.neural.inputs import ENHANCED
from nacre.neural.nbrdf import PRECISIONS, round_layers
from nacre.neural.recipe import Recipe
from nacre.neural.samples import Samples, direction_inputs
from nacre.neural.scattered import (
    OWN_FRACTION,
    SCATTERED_SAMPLES,
    WEIGHT,
    check_count,
    clamped,
    hold_out,
    repeated,
    validation_errors,
    with_mirrored,
)
from nacre.neural.spectral import LAST, MOST_COEFFICIENTS, SpectralBrdf
from nacre.neural.training import initial_layers, train
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.sampling import check_isotropic, draw_samples, fit_lobes

COEFFICIENTS = 10  # outputs of the network, if there are as many bands
SAMPLES = 400_000
"""Samples drawn from what is no scan; five times as many where it is anisotropic."""
_SPECTRA = 4096  # spectra from which the map from coefficients to bands is found
_TRIAL = 20  # one in so many epochs chooses among the starts


@dataclass(frozen=True)
class _Data:
    training: Samples
    held_out: Samples
    spectra: Floats  # (n, bands), to rebuild
    highest: Doubles | None  # means that no fit to a scan exceeds, (k,)


def fit_spectral(
    brdf: Brdf,
    recipe: Recipe | None = None,
    *,
    coefficients: int = COEFFICIENTS,
    progress: Progress | None = None,
) -> SpectralBrdf:
    """Fit a spectral network to a reflectance that is known by wavelength.

    Parameters
    ----------
    brdf
        A reflectance with spectra (:attr:`nacre.Brdf.wavelengths`): a scan, a table, or a formula.
    recipe
        Settings; :meth:`Recipe.spectral` where None. Inputs are enhanced and hidden layers squared
        ReLUs; there is no `size`.
    coefficients
        Outputs of the network, at most 32; as many as there are bands, if these are fewer.
    progress
        Called as the fit goes on.

    Returns
    -------
    SpectralBrdf
        In the channels of `brdf`, with lobes for importance sampling fitted to it, and settings and
        errors in its metadata.

    Raises
    ------
    NacreError
        If there are no spectra, a setting does not apply, hardly any sample is valid, a scan has
        too few, or training diverges.
    ValueError
        If there are more coefficients than a file holds.
    """
    from nacre.neural.replicas import ReplicaTrainer

    expect_brdf(brdf, "a fit")
    check_isotropic(brdf)
    report, settings = progress or silent, _settled(brdf, recipe or Recipe.spectral())
    assert brdf.wavelengths is not None
    if not 1 <= coefficients <= MOST_COEFFICIENTS:
        raise ValueError(f"coefficients must be 1 to {MOST_COEFFICIENTS}, got {coefficients}")
    broad = BroadBands.of(brdf.wavelengths, coefficients)
    scan = brdf.scattered()
    if scan is None:
        data = _drawn(brdf, broad, settings, report)
    else:
        data = _scanned(scan, broad, settings, report)
    sizes = settings.hidden, settings.seed, data.training.inputs
    starts = [initial_layers(*sizes, k, data.training.outputs) for k in range(settings.starts)]
    how = settings.batch, SQUARED_RELU, settings.epochs // _TRIAL, data.held_out
    with ReplicaTrainer(starts, *how) as trainer:
        quality = train(trainer, data.training, data.held_out, settings, progress)
        layers = trainer.layers()
    if not math.isfinite(sum(quality.values())):
        raise NacreError(f"{brdf.name}: training diverged; lower the learning rate")
    report("sampling lobes", 0, 1, "")
    network = _network(brdf, broad, data, layers, settings)
    facts = asdict(settings) | {"hidden": list(settings.hidden)}
    if scan is not None:
        measured: Any = scan  # which has spectra, as the material does
        how_split = measured.spectra, network.eval_spectral, settings.held_out, settings.seed
        quality |= validation_errors(scan, *how_split)
        facts |= {"gain": None, "sampling": None}
    metadata: dict[str, Any] = {"fit": facts, "quality": quality}
    if brdf.source:
        metadata["source"] = dict(brdf.source)
    with one_blas_thread():
        network = network.replaced(metadata=metadata, notes=brdf.notes)
        network = network.replaced(sampler=fit_lobes(network))
    report("sampling lobes", 1, 1, "")
    return network


def _settled(brdf: Brdf, recipe: Recipe) -> Recipe:
    """The recipe with nothing left open."""
    name, scan = brdf.name or "this material", brdf.scattered()
    if brdf.wavelengths is None:
        raise NacreError(f"{name}: is known in RGB only, and a spectral network needs spectra")
    if recipe.physical or recipe.inputs not in (None, ENHANCED):
        raise NacreError(
            f"{name}: spectral networks have enhanced inputs and are not physical; leave these "
            "settings out"
        )
    if recipe.size is not None:
        raise NacreError(f"{name}: spectral networks have no size limit; choose the hidden layers")
    if recipe.activation not in (None, SQUARED_RELU):
        raise NacreError(f"{name}: spectral networks have squared ReLUs; leave the activation out")
    usual = SAMPLES if scan is None else SCATTERED_SAMPLES
    usual *= 1 if brdf.isotropic else 5
    settled = replace(
        recipe,
        inputs=ENHANCED,
        samples=recipe.samples or round(recipe.sample_share * usual),
        precision=recipe.stored_precision,
        activation=SQUARED_RELU,
        gain=recipe.loss_gain if scan is None else 1.0,
    )
    if scan is None:
        return settled
    check_count(scan)
    half = max(16, recipe.batch // 32 * 16)
    return replace(settled, batch=half, learning_rate=0.5 * recipe.learning_rate)


def _drawn(brdf: Brdf, broad: BroadBands, recipe: Recipe, report: Progress) -> _Data:
    """Samples of what is known at any pair of directions."""

    def values(wi: Floats, wo: Floats) -> Floats:
        return broad.means(brdf.eval_spectral(wi, wo))

    def sampled(done: int, total: int) -> None:
        report("sampling", done, total, "")

    count, how = recipe.samples or SAMPLES, recipe.sampling
    drawn = draw_samples(brdf, count, recipe.seed, sampled, how, values)
    samples = _packed(drawn, brdf.isotropic, recipe.loss_gain * drawn.cosine)
    some = slice(0, _SPECTRA)
    spectra = brdf.eval_spectral(drawn.wi[some], drawn.wo[some])
    return _Data(*samples.split(recipe.held_out), spectra, None)


def _scanned(scan: Any, broad: BroadBands, recipe: Recipe, report: Progress) -> _Data:
    """Samples of a scan; see :mod:`nacre.neural.scattered`."""
    kept, held = hold_out(len(scan.samples), recipe.held_out, recipe.seed)
    # From here on it is a scan in broad bands, which are fewer to interpolate.
    coarse = scan.with_spectra(broad.means(scan.spectra), broad.centers)
    part = coarse.subset(kept)

    def sampled(done: int, total: int) -> None:
        report("sampling", done, total, "")

    count = recipe.samples or SCATTERED_SAMPLES
    own = repeated(_own(part), OWN_FRACTION * count, recipe.seed)
    rest = max(0, count - len(own))
    drawn = augmentation(part, rest, recipe.seed, sampled, part.eval_spectral)
    # Blocks of samples train together: they should not be all of one kind.
    order = np.random.default_rng((recipe.seed, 4)).permutation(len(own) + rest)
    wi, wo, values = (
        np.concatenate([a, b])[order]
        for a, b in ((own.wi, drawn.wi), (own.wo, drawn.wo), (own.rgb, drawn.rgb))
    )
    every, judged = DirectionSamples(wi, wo, values), _own(coarse.subset(held))
    return _Data(
        _packed(every, scan.isotropic, np.full(len(every), WEIGHT)),
        _packed(judged, scan.isotropic, judged.cosine),
        scan.spectra[kept],
        part.spectra.max(axis=0),
    )


def _own(scan: Any) -> DirectionSamples:
    """The samples of a scan with its spectra in place of colors."""
    samples = scan.samples
    return with_mirrored(replace(samples, rgb=scan.spectra), scan.mirrored)


def _packed(samples: DirectionSamples, isotropic: bool, weight: Floats) -> Samples:
    return Samples.pack(direction_inputs(samples, isotropic, ENHANCED), samples.rgb, weight)


def _network(
    brdf: Brdf, broad: BroadBands, data: _Data, layers: Sequence[Layer], recipe: Recipe
) -> SpectralBrdf:
    activations = [*[SQUARED_RELU] * (len(layers) - 1), LAST]
    if data.highest is not None:
        layers = clamped(layers, data.highest)
        activations[-1:] = [RELU, LAST]
    rounded = [
        Layer(kept.weights, layer.biases)
        for kept, layer in zip(round_layers(layers, recipe.stored_precision), layers, strict=True)
    ]
    spectra = broad.rebuilding(data.spectra).astype(PRECISIONS[recipe.stored_precision])
    network = SpectralBrdf(
        rounded,
        activations,
        spectra,
        np.asarray(brdf.wavelengths),
        inputs=ENHANCED if brdf.isotropic else "enhanced anisotropic",
        name=brdf.name,
        precision=recipe.stored_precision,
    )
    return network.in_channels(brdf.channels)
