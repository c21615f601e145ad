"""Materials from few samples: planned or random ones, how close, and how sure.

Every network in a folder is a material; a seeded fifth of them is held out, as in
:mod:`lab.studies.ablations.latent_codes`, and the basis, the plan and the principal components know
only the others. Pictures have 64 x 64 pixels with 96 directions of light.

- errors under the environment map, of samples at planned pairs of directions, at random ones, and
  at those that the criterion of Nielsen, Jensen and Ramamoorthi 2015 gives: pairs chosen one after
  the other for the smallest condition number of principal components of the logarithm, with ridge
  regression on these;
- how often intervals of 90 % hold the truth: of f_r at random pairs, of the albedo, of pixels;
- with `--faults`: noise that the samples state, outliers, and a wrong scale;
- with `--cornell`: Cornell's scans, in the included basis, which does not know them: of planned
  ones of a scan's samples the others are predicted, beside analytic models fitted to all samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import Study, data, log, museum, picture_errors, progress
from nacre import analytic
from nacre.brdf import Brdf
from nacre.geometry import join, uniform_rusinkiewicz
from nacre.latent import NeuralBasis, PcaBasis, pretrained_basis
from nacre.latent.estimates import albedo_interval
from nacre.latent.intervals import reflectance_interval
from nacre.latent.pca import encoded
from nacre.measured.merl import node_directions
from nacre.measured.scattered import ScatteredBrdf
from nacre.measuring import Design, Exposures, Instrument
from nacre.metrics import albedo
from nacre.metrics.comparison import plausible_views
from nacre.mitsuba.sphere import standard_lights
from nacre.numerics.direction_samples import DirectionSamples
from nacre_lab.reproduce.codes import CodeSettings, bases, split

COUNTS = 1, 2, 4, 8, 16, 20, 32, 64, 100
PAIRS = 512
"""Random pairs of directions at which intervals of f_r are checked."""
DRAWS = 64
RIDGE = 0.1
"""Weight of the squared code beside the sum of squared errors of the logarithm."""
CANDIDATES = 4000
"""Nodes of the grid that the pattern of the smallest condition number is chosen from."""
STEEPEST = 80.0, 75.0
"""Angles to the normal up to which samples of Cornell's scans are planned."""

Directions = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]


def planned(basis: NeuralBasis, count: int, instrument: Instrument | None = None) -> Directions:
    """The plan of so many pairs; that of fewer are its first."""
    exposures = (instrument or Instrument()).exposures()
    design = Design(basis, basis.examples, exposures)
    for _ in range(count):
        design.choose()
    return exposures.wi[design.chosen][:, 0], exposures.wo[design.chosen][:, 0]


def random_pairs(count: int, seed: int) -> Directions:
    """Pairs uniform in the Rusinkiewicz angles, both directions 3 degrees above the horizon."""
    u = np.random.default_rng((seed, 11)).random((4, 8 * count + 64), dtype=np.float32)
    u[1] = 0.0
    wi, wo = (join(np.broadcast_arrays(*w)) for w in uniform_rusinkiewicz(u))
    above = (wi[:, 2] > 0.05) & (wo[:, 2] > 0.05)
    return wi[above][:count], wo[above][:count]


class Conditioned:
    """Pairs by the smallest condition number of principal components, and the regression."""

    def __init__(self, pca: PcaBasis, count: int) -> None:
        self._pca = pca
        nodes = np.flatnonzero(pca.mask.reshape(-1))
        nodes = np.random.default_rng(0).permutation(nodes.size)[:CANDIDATES]
        parts = pca.components[pca.uses][:, nodes].T.astype(np.float64) * pca.deviations
        rows = (parts[:, None, :] * pca.colors.T).reshape(len(nodes), -1, pca.code_dim)
        chosen: list[int] = []
        gram = RIDGE * np.eye(pca.code_dim)
        for _ in range(count):
            products = gram + rows.swapaxes(1, 2) @ rows
            values = np.linalg.eigvalsh(products)
            scores = values[:, -1] / values[:, 0]
            scores[chosen] = np.inf
            best = int(np.argmin(scores))
            chosen.append(best)
            gram = products[best]
        self._rows, self._nodes = rows[chosen], nodes[chosen]
        flat = np.flatnonzero(pca.mask.reshape(-1))[self._nodes]
        wi, wo = (
            np.stack(np.broadcast_arrays(*w, 0.0 * pca.mask)[:3], axis=-1).reshape(-1, 3)[flat]
            for w in node_directions(pca.resolution)
        )
        self.pairs: Directions = wi, wo

    def decode(self, truth: Brdf, count: int) -> Brdf:
        """What ridge regression makes of the first samples."""
        pca, nodes = self._pca, self._nodes[:count]
        wi, wo = (w[:count] for w in self.pairs)
        rows = self._rows[:count].reshape(-1, pca.code_dim)
        logs = encoded(truth.eval(wi, wo), pca.weights()[nodes]) - pca.center[nodes, None]
        normal = rows.T @ rows + RIDGE * np.eye(pca.code_dim)
        return pca.decode(np.linalg.solve(normal, rows.T @ logs.reshape(-1)))


def sampled(truth: Brdf, pairs: Directions, count: int) -> DirectionSamples:
    """The first samples."""
    wi, wo = (w[:count] for w in pairs)
    return DirectionSamples(wi, wo, truth.eval(wi, wo))


def held(basis: NeuralBasis, truth: Brdf, samples: DirectionSamples) -> tuple[float, ...]:
    """Fractions of f_r, of the albedo and of pixels that lie in their intervals."""
    codes = basis.posterior(samples).draw(DRAWS)
    materials = [basis.decode(code) for code in codes]
    pairs = random_pairs(PAIRS, 1)
    f_r = truth.eval(*pairs)
    low, high = reflectance_interval(materials, *pairs)
    darkest, brightest = albedo_interval(materials)
    own = albedo(truth, 0.0).value
    light = standard_lights(museum(), 32)["environment"]
    views = plausible_views(truth, materials, light, 16)
    inside = ((f_r >= low) & (f_r <= high)).mean(), ((own >= darkest) & (own <= brightest)).mean()
    return float(inside[0]), float(inside[1]), views.inside


def faulty(
    truth: Brdf, pairs: Directions, count: int, kind: str, seed: int
) -> tuple[DirectionSamples, Mapping[str, bool]]:
    """Samples with a fault, and what is said of it."""
    samples = sampled(truth, pairs, count)
    random = np.random.default_rng((seed, 12))
    if kind.startswith("noise"):
        sigma = 0.2 * samples.rgb.mean(axis=1)
        noisy = np.maximum(samples.rgb + sigma[:, None] * random.normal(size=samples.rgb.shape), 0)
        known = None if kind.endswith("not stated") else sigma
        return DirectionSamples(samples.wi, samples.wo, noisy.astype(np.float32), known), {}
    if kind.startswith("a tenth"):
        factor = np.ones(count)
        factor[random.permutation(count)[: max(1, count // 10)]] = 10.0
        rgb = (samples.rgb * factor[:, None]).astype(np.float32)
        return DirectionSamples(samples.wi, samples.wo, rgb), {}
    rgb = 1.5 * samples.rgb
    return DirectionSamples(samples.wi, samples.wo, rgb), {"free_scale": kind.endswith("free")}


FAULTS = (
    *("noise of 20 %, not stated", "noise of 20 %, stated"),
    "a tenth ten times too bright",
    *("scale wrong by 1.5", "scale wrong by 1.5, free"),
)


def cornell(paths: Sequence[Path], count: int) -> list[tuple[str, ...]]:
    """Errors of samples of scans that were not used: of the logarithm, and relative."""
    basis = pretrained_basis()
    rows = []
    for path in paths:
        scan = nacre.load(path)
        assert isinstance(scan, ScatteredBrdf)
        samples = scan.samples
        errors = {}
        for degrees in STEEPEST:
            lowest = np.cos(np.radians(degrees))
            reached = np.flatnonzero(np.minimum(samples.wi[:, 2], samples.wo[:, 2]) >= lowest)
            pairs = samples.wi[reached, None], samples.wo[reached, None]
            exposures = Exposures(*(w.astype(np.float32) for w in pairs))
            design = Design(basis, basis.examples, exposures)
            for _ in range(count):
                design.choose()
            chosen = reached[design.chosen]
            rest = np.setdiff1d(np.arange(len(samples)), chosen)
            few = basis.decode(basis.encode(samples[chosen]))
            errors[f"{count} planned, up to {degrees:g}°"] = _missed(few, samples[rest])
        for name, model in analytic.MODELS.items():
            if model.isotropic:
                fitted = analytic.fit(scan, model)
                errors[f"{name}, all {len(samples)}"] = _missed(fitted, samples[rest])
        for name, (logs, relative) in errors.items():
            log(path.stem, name, f"{logs:.4f}", f"{relative:.3f}")
            rows.append((path.stem, name, f"{logs:.4f}", f"{relative:.1%}"))
    return rows


def _missed(brdf: Brdf, samples: DirectionSamples) -> tuple[float, float]:
    """Mean absolute error of log(1 + 32 f cos theta_i), and the median relative one."""
    f_r = brdf.eval(samples.wi, samples.wo)
    scale = 32.0 * samples.cosine[:, None]
    logs = np.abs(np.log1p(scale * f_r) - np.log1p(scale * np.maximum(samples.rgb, 0.0))).mean()
    known = samples.rgb > 1e-3
    return float(logs), float(np.median(np.abs(f_r - samples.rgb)[known] / samples.rgb[known]))


def main() -> None:
    """Print the tables asked for."""
    study = Study(__doc__, __file__)
    study.add_argument("folder", nargs="?", type=Path, help="networks; the published MERL ones")
    study.add_argument("--counts", type=int, nargs="*", default=COUNTS, help="samples")
    study.add_argument("--faults", action="store_true", help="noise, outliers, a wrong scale")
    study.add_argument("--cornell", action="store_true", help="scans of Cornell's")
    options = study.options()
    if options.cornell:
        columns = "scan", "predicted by", "log error", "median relative error"
        paths = sorted(data("cornell").glob("*.brdf"))
        study.table(columns, cornell(study.few(paths, 1), 32), "cornell")
        return
    files = study.few(sorted((options.folder or data("pretrained", "merl")).glob("*.h5")), 20)
    settings = CodeSettings(seed=options.seed)
    if options.quick:
        settings = CodeSettings(seed=options.seed, steps=500, mixtures=60)
    training, held_out = split(files, options.seed)
    found = bases(training, ["neural", "pca"], settings, study.cache, progress)
    neural, pca = found["neural"], found["pca"]
    assert isinstance(neural, NeuralBasis)
    assert isinstance(pca, PcaBasis)
    counts = study.few(options.counts, 2)
    most = max(counts)
    plan = planned(neural, most)
    chance = random_pairs(most, options.seed)
    part = f"seed {options.seed}"
    if options.faults:
        rows = [fault_row(neural, held_out, plan, n, kind) for kind in FAULTS for n in counts]
        study.table(("fault", "samples", "environment MAE"), rows, f"faults {part}")
        return
    conditioned = Conditioned(pca, most)
    rows = []
    for count in counts:
        errors = []
        for path in held_out:
            truth = nacre.load(path)
            materials = [
                neural.decode(neural.encode(sampled(truth, plan, count))),
                neural.decode(neural.encode(sampled(truth, chance, count))),
                neural.decode(neural.encode(sampled(truth, conditioned.pairs, count))),
                conditioned.decode(truth, count),
            ]
            own = [picture_errors(truth, m, museum(), size=64, directions=96)[0] for m in materials]
            inside = [*held(neural, truth, sampled(truth, plan, count))]
            inside += held(neural, truth, sampled(truth, chance, count))
            errors.append([*own, *inside])
            log(count, path.stem, *(f"{x:.4f}" for x in own), *(f"{x:.2f}" for x in inside))
        mean, worst = np.mean(errors, axis=0), np.max(errors, axis=0)
        cells = [f"{m:.4f} ({w:.3f})" for m, w in zip(mean[:4], worst[:4], strict=True)]
        holding = [" / ".join(f"{x:.0%}" for x in part) for part in (mean[4:7], mean[7:])]
        rows.append((str(count), *cells, *holding))
    columns = (
        *("samples", "planned", "random", "least condition number"),
        *("the same, principal components", "90 % hold, planned", "random"),
    )
    note = "MAE under the environment, mean (worst); intervals of f_r / albedo / pixels."
    study.table(columns, rows, part, note)


def fault_row(
    basis: NeuralBasis, held_out: Sequence[Path], plan: Directions, count: int, kind: str
) -> tuple[str, ...]:
    """One line: the mean error of held-out materials."""
    errors = []
    for index, path in enumerate(held_out):
        truth = nacre.load(path)
        samples, said = faulty(truth, plan, count, kind, index)
        decoded = basis.decode(basis.posterior(samples, **said).code)
        errors.append(picture_errors(truth, decoded, museum(), size=64, directions=96)[0])
    return kind, str(count), f"{np.mean(errors):.4f}"


if __name__ == "__main__":
    main()
