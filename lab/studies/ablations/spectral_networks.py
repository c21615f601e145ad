"""Ways to make a network over wavelength, and what it gains over RGB and over the table.

Three ways at about equal bytes, on the Cornell scans: coefficients of broad bands from a network,
and a matrix from these to all bands (what `nacre.neural.spectral_fit` does); every band an output;
the wavelength as an input. Each is fitted to all bands, and to every second band, and judged at
samples held out of the fit, and at the bands left out, linear in the wavelength between others.

Then the first of these against an RGB network of the same scan and the interpolated scan, also for
materials of which everything is known: rough gold, copper and aluminium, and a soap film's colors
on glass, sampled at the directions of a Cornell scan. Refractive indices are those that Mitsuba
ships. Errors are mean CIEDE2000 differences at held-out samples under D65, A and F11, for the
2-degree observer, of surfaces with reflectance factor pi f_r, and the median relative error of f_r.

The first table is the mean over `--seeds` seeds, each of which holds out other samples and trains
from other weights; the second is from one.

Run `python -m lab.studies.ablations.spectral_networks`: some 15 minutes on two idle cores.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import Study, data, log
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import require
from nacre.geometry import half_vector, split
from nacre.instruments import mean_differences
from nacre.measured import ScatteredBrdf
from nacre.neural import Recipe, fit, fit_spectral
from nacre.neural.augmentation import augmentation
from nacre.neural.inputs import ENHANCED
from nacre.neural.replicas import ReplicaTrainer
from nacre.neural.samples import Samples, direction_inputs
from nacre.neural.scattered import WEIGHT, hold_out, relative_errors, with_mirrored
from nacre.neural.training import initial_layers, train
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.mlp import SQUARED_RELU, forward
from nacre.spectra import to_rgb

Array = npt.NDArray[np.float64]
Method = Callable[[ScatteredBrdf, int], tuple[Brdf, int]]
Predict = Callable[[Array, Array], Array]  # f_r per band from directions (n, 3)

SCANS = "garnet_red", "cayman", "krylon_blue"
BANDS = np.arange(400.0, 701.0, 10.0)
ROUGHNESS = 0.3
FILM = 1.33, 450.0, 1.5  # index and thickness in nm of a film, index of what it lies on
COLUMNS = "bytes", "D65", "A", "F11", "f_r, %"


class Judged(Brdf):
    """A function of directions, to be judged as a reflectance."""

    def __init__(self, predict: Predict, wavelengths: Array) -> None:
        super().__init__(name="judged")
        self.predict, self.wavelengths = predict, wavelengths

    def eval_components(self, wi, wo):  # type: ignore[no-untyped-def]
        raise NotImplementedError

    def eval_bands(self, wi: Floats, wo: Floats) -> Floats:
        return self.predict(np.asarray(wi, np.float64), np.asarray(wo, np.float64))


class Truth(Judged):
    """A rough surface under a Fresnel term of every band, `fresnel` of the cosine (n,), (n, bands):
    GGX normals with Smith's shadowing, heights correlated.
    """

    def __init__(self, fresnel: Callable[[Array], Array]) -> None:
        super().__init__(self._values, BANDS)
        self._fresnel = fresnel

    def _values(self, wi: Array, wo: Array) -> Array:
        square = ROUGHNESS**2
        h = half_vector(split(wi), split(wo))
        cosine = np.clip(sum(a * b for a, b in zip(split(wi), h, strict=True)), 0.0, 1.0)
        normals = square / (math.pi * (h[2] ** 2 * (square - 1.0) + 1.0) ** 2)
        light, view = wi[:, 2], wo[:, 2]
        smith = light * np.sqrt(square + (1.0 - square) * view**2)
        smith += view * np.sqrt(square + (1.0 - square) * light**2)
        return (normals * 0.5 / smith)[:, None] * self._fresnel(cosine)


def conductor(name: str) -> Callable[[Array], Array]:
    """Fresnel's reflectance of a metal, unpolarized, by Mitsuba's indices."""
    folder = Path(require("mitsuba", "render").__file__).parent / "data" / "ior"
    tables = [np.loadtxt(folder / f"{name}.{part}.spd").T for part in ("eta", "k")]
    index, extinction = (np.interp(BANDS, *table) for table in tables)
    eta = index + 1j * extinction

    def fresnel(cosine: Array) -> Array:
        c = cosine[:, None]
        inside = np.sqrt(1.0 - (1.0 - c**2) / eta**2)
        s, p = (c - eta * inside) / (c + eta * inside), (eta * c - inside) / (eta * c + inside)
        return np.asarray(0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2))

    return fresnel


def film(cosine: Array) -> Array:
    """Reflectance of a thin film (Airy 1833), unpolarized."""
    index, thickness, below = FILM
    c = cosine[:, None]
    inside = np.sqrt(1.0 - (1.0 - c**2) / index**2)
    last = np.sqrt(1.0 - (1.0 - c**2) / below**2)
    turn = np.exp(4j * math.pi * index * thickness * inside / BANDS)
    s = [(a - b) / (a + b) for a, b in ((c, index * inside), (index * inside, below * last))]
    p = [
        (index * c - inside) / (index * c + inside),
        (below * inside - index * last) / (below * inside + index * last),
    ]
    waves = [(one + two * turn) / (1.0 + one * two * turn) for one, two in (s, p)]
    return np.asarray(0.5 * sum(np.abs(wave) ** 2 for wave in waves))


def scans() -> Iterator[tuple[str, ScatteredBrdf]]:
    """Name and samples of every material."""
    for name in SCANS:
        yield name, nacre.load(data("cornell", f"{name}.brdf"))
    like = nacre.load(data("cornell", "garnet_red.brdf")).samples
    made = {"gold": conductor("Au"), "copper": conductor("Cu"), "aluminium": conductor("Al")}
    for name, fresnel in {**made, "thin film": film}.items():
        spectra = Truth(fresnel).eval_bands(like.wi, like.wo)
        rgb = to_rgb(spectra, BANDS)
        where = like.wi, like.wo
        yield name, ScatteredBrdf(*where, rgb, name, spectra=spectra, wavelengths=BANDS)


def in_part(scan: ScatteredBrdf, step: int) -> ScatteredBrdf:
    """A scan in every so many bands."""
    assert scan.spectra is not None
    assert scan.wavelengths is not None
    return scan.replaced(spectra=scan.spectra[:, ::step], wavelengths=scan.wavelengths[::step])


def row(scan: ScatteredBrdf, seed: int, judged: Brdf, nbytes: int) -> list[str]:
    """Bytes and errors at the held-out samples."""
    _, held = hold_out(len(scan.samples), 0.2, seed)
    part = scan.subset(held)
    where = part.samples.wi, part.samples.wo
    truth = Judged(lambda wi, wo: np.maximum(part.spectra, 0.0), scan.wavelengths)
    found = mean_differences(truth, judged, *where)
    cells = [f"{nbytes:,}", *(f"{value:.3f}" for value in found.values())]
    if judged.wavelengths is None:
        return [*cells, ""]
    return [*cells, f"{100.0 * relative_errors(judged.eval_spectral(*where), part.spectra)[0]:.1f}"]


def left_out(scan: ScatteredBrdf, seed: int, judged: Brdf) -> str:
    """Median relative error in the bands between those that were fitted, in percent."""
    _, held = hold_out(len(scan.samples), 0.2, seed)
    part, found = scan.subset(held), np.empty((len(held), len(scan.wavelengths)))
    values = judged.eval_spectral(part.samples.wi, part.samples.wo)
    for index, spectrum in enumerate(values):
        found[index] = np.interp(scan.wavelengths, judged.wavelengths, spectrum)
    return f"{100.0 * relative_errors(found[:, 1::2], part.spectra[:, 1::2])[0]:.1f}"


def trained(
    x: Array, y: Array, held: Sequence[Array], hidden: Sequence[int], seed: int
) -> tuple[Predict, int]:
    """A network from inputs (n, k) to log(1 + y), as fits to scans train, and its numbers."""
    training = Samples.pack(x, y, np.full(len(x), WEIGHT))
    judging = Samples.pack(*held)
    starts = [initial_layers(hidden, seed, x.shape[1], k, y.shape[1]) for k in range(4)]
    usual = Recipe.spectral(batch=256, seed=seed)
    recipe = replace(usual, learning_rate=0.5 * usual.learning_rate)  # as fits to scans have it
    with ReplicaTrainer(starts, 256, SQUARED_RELU, recipe.epochs // 20, judging) as trainer:
        train(trainer, training, judging, recipe)
        layers = trainer.layers()
    count = sum(layer.weights.size + layer.biases.size for layer in layers)
    bound = y.max(axis=0)

    def predict(inputs: Array, _: Array) -> Array:
        out = forward(inputs.astype(np.float32), layers, SQUARED_RELU)
        return np.clip(np.exp(np.minimum(out, 80.0)) - 1.0, 0.0, bound)

    return predict, count


def seen(wi: Array, wo: Array) -> Array:
    """Enhanced inputs of pairs of directions, (n, 6)."""
    return direction_inputs(DirectionSamples(wi, wo, wi), True, ENHANCED)


def samples(scan: ScatteredBrdf, seed: int) -> tuple[Array, Array, list[Array]]:
    """Inputs (n, 6) and spectra to train on, and inputs, spectra and weights of held-out ones."""
    kept, held = hold_out(len(scan.samples), 0.2, seed)
    part, last = scan.subset(kept), scan.subset(held)
    own, judged = (
        with_mirrored(DirectionSamples(s.samples.wi, s.samples.wo, s.spectra), True)
        for s in (part, last)
    )
    repeats = round(160_000 / len(own))
    more = augmentation(part, 160_000, seed, values=part.eval_spectral)
    pairs = ((own.wi, more.wi), (own.wo, more.wo), (own.rgb, more.rgb))
    wi, wo, f = (np.concatenate([np.tile(a, (repeats, 1)), b]) for a, b in pairs)
    order = np.random.default_rng(seed).permutation(len(wi))
    held_out = [seen(judged.wi, judged.wo), judged.rgb, judged.wi[:, 2]]
    return seen(wi, wo)[order], np.maximum(f[order], 0.0), held_out


def as_outputs(scan: ScatteredBrdf, seed: int) -> tuple[Brdf, int]:
    """Every band an output of the network."""
    x, y, held = samples(scan, seed)
    predict, count = trained(x, y, held, (32, 32, 32), seed)
    return Judged(lambda wi, wo: predict(seen(wi, wo), wo), np.asarray(scan.wavelengths)), 2 * count


def as_input(scan: ScatteredBrdf, seed: int) -> tuple[Brdf, int]:
    """The wavelength, and its square and cube, inputs of a network with one output."""
    x, y, (held_x, held_y, weight) = samples(scan, seed)
    bands = np.asarray(scan.wavelengths)

    def with_band(inputs: Array, places: Array) -> Array:
        s = (bands[places] - 550.0) / 150.0
        return np.concatenate([inputs, np.stack([s, s * s, s**3], axis=1)], axis=1)

    random = np.random.default_rng((seed, 7))
    places = random.integers(0, len(bands), (2, len(x)))
    wide = np.concatenate([with_band(x, part) for part in places])
    values = np.concatenate([y[np.arange(len(x)), part] for part in places])[:, None]
    judged = random.integers(0, len(bands), len(held_x))
    held = [with_band(held_x, judged), held_y[np.arange(len(judged)), judged][:, None], weight]
    predict, count = trained(wide, values, held, (37, 37, 37), seed)

    def predict_bands(wi: Array, wo: Array) -> Array:
        inputs = seen(wi, wo)
        columns = [with_band(inputs, np.full(len(wi), k)) for k in range(len(bands))]
        return np.concatenate([predict(column, column) for column in columns], axis=1)

    return Judged(predict_bands, bands), 2 * count


def as_coefficients(scan: ScatteredBrdf, seed: int) -> tuple[Brdf, int]:
    """What nacre does."""
    network = fit_spectral(scan, Recipe.spectral(seed=seed))
    return network, network.nbytes


WAYS = {
    "coefficients of broad bands": as_coefficients,
    "every band an output": as_outputs,
    "wavelength an input": as_input,
}


def fitted(scan: ScatteredBrdf, seed: int) -> tuple[Brdf, int]:
    """An RGB network."""
    network = fit(scan, Recipe(seed=seed))
    return network, network.nbytes


def interpolated(scan: ScatteredBrdf, seed: int) -> tuple[Brdf, int]:
    """The samples that are not held out: spectra, and two angles for each direction, in float32."""
    part = scan.subset(hold_out(len(scan.samples), 0.2, seed)[0])
    return part, 4 * (np.size(part.spectra) + 4 * len(part.samples))


def averaged(scan: ScatteredBrdf, seeds: Sequence[int], method: Method) -> list[str]:
    """The mean over seeds of :func:`row`."""
    rows = []
    for seed in seeds:
        rows.append(row(scan, seed, *method(scan, seed)))
        log(scan.name, method.__name__, seed, *rows[-1])
    return [mean(column) for column in zip(*rows, strict=True)]


def mean(cells: Sequence[str]) -> str:
    """A cell with the mean of cells, which have the same number of digits."""
    if len(set(cells)) == 1:
        return cells[0]
    digits = len(cells[0].partition(".")[2])
    return f"{np.mean([float(cell) for cell in cells]):.{digits}f}"


def main() -> None:
    """Print the tables."""
    study = Study(__doc__, __file__)
    study.add_argument("--seeds", type=int, default=3, help="how many to average (default: 3)")
    study.add_argument("--table", choices=("materials", "ways"), help="one of the two alone")
    options = study.options()
    seeds = range(options.seed, options.seed + (1 if options.quick else options.seeds))
    every = dict(study.few(list(scans()), 1))
    kinds = {"RGB network": fitted, "spectral network": as_coefficients}
    kinds["interpolated"] = interpolated
    if options.table != "ways":
        rows = [
            [f"{name}, {kind}", *averaged(scan, seeds, method)]
            for name, scan in every.items()
            for kind, method in kinds.items()
        ]
        study.table(("", *COLUMNS), rows, "materials")
    if options.table != "materials":
        rows = []
        for name in study.few(SCANS, 1):
            scan = every[name]
            for way, method in WAYS.items():
                log(name, way)
                whole = row(scan, options.seed, *method(scan, options.seed))
                half = method(in_part(scan, 2), options.seed)[0]
                rows.append([f"{name}, {way}", *whole, left_out(scan, options.seed, half)])
        study.table(("", *COLUMNS, "bands left out, %"), rows, "ways")


if __name__ == "__main__":
    main()
