"""Predicted lobes beside searched ones: how much of the variance a prediction from a code leaves.

A neural basis and an autoencoder are trained with their predictors, on MERL, Nielsen's and RGL
networks without those of the tables at hand; or, with `--merl`, on four fifths of the MERL
networks. What is left over is judged: the seven RGL tables, or the other MERL networks. Its code is
found, lobes are predicted from it, and the second moment of f cos(theta_i) / p under them is set
beside that of lobes found for the material itself, at directions that neither has seen. Kinds of
lobes:

- cosine + Blinn-Phong, and cosine + GGX: those of the model that looks most alike (fitted), those
  of least variance (searched), and predicted ones. Predictors learned by variance; or by labels as
  the NBRDF paper has it (section 3.3), from models fitted to the training materials or,
  "published", from the fits of Ngan et al. 2005 to those that have one. Codes are of the neural
  basis, or what the encoder of the autoencoder gives, as in the paper;
- the two lobes of `fit_lobes`, predicted, and refined from the prediction by Newton steps.

Run `python -m lab.studies.ablations.predicted_lobes [--merl]`. The bases are kept with the results
and trained only if they are not there yet.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import torch

import nacre
from lab.studies.ablations.sampling import fit_plain_ggx
from lab.studies.study import Study, data, log, rgl_tables
from nacre.analytic.labels import fitted_lobes, model_lobes
from nacre.analytic.tables import load as load_fit
from nacre.analytic.tables import materials as fitted_names
from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.geometry import split
from nacre.latent import LobePredictor, with_labels
from nacre.latent.predicting import PredictingBasis
from nacre.numerics.newton import minimize
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling import fit_blinn_phong, fit_lobes
from nacre.sampling.mixture_moment import MixtureMoment
from nacre.sampling.moment import Moment, second_moment
from nacre.sampling.parametrizations import MixtureParametrization
from nacre_lab.reproduce.codes import CodeSettings, bases
from nacre_lab.reproduce.codes import split as split_files

Fit = Callable[[Brdf, Floats], Sampler]
"""From a material and its code to its lobes."""

ENCODING = "(the code itself)"
SEEN = 1234
"""Seed of the directions that judge."""


def materials(seed: int | None) -> tuple[list[Path], list[Path]]:
    """Files to train on, and files to judge."""
    networks = {
        name: sorted(data("pretrained", name).glob("*.h5")) for name in ("merl", "nielsen", "rgl")
    }
    if seed is not None:
        return split_files(networks["merl"], seed)
    tables = rgl_tables("*_rgb.bsdf")
    known = {table.stem for table in tables}
    every = [path for paths in networks.values() for path in paths]
    return [path for path in every if path.stem not in known], tables


def by_published(basis: PredictingBasis, labels: Path) -> LobePredictor:
    """Blinn-Phong lobes by labels: published fits to the materials that have one."""
    known, trained = set(fitted_names(labels)), basis.metadata["materials"]
    lobes = [model_lobes(load_fit(labels, name)) if name in known else None for name in trained]
    log(f"{sum(lobe is not None for lobe in lobes)} labels")
    return with_labels(basis, {"blinn-phong": lobes}).predictors["blinn-phong by labels"]


def judged(
    files: Sequence[Path], fits: dict[str, Fit], basis: PredictingBasis
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Second moments, and milliseconds of a core that finding the lobes takes, by kind."""
    moments: dict[str, list[float]] = {name: [] for name in fits}
    times: dict[str, list[float]] = {name: [] for name in (*fits, ENCODING)}
    for path in files:
        brdf = nacre.load(path)
        seen = second_moment(brdf, SEEN)
        basis.encode(brdf)  # what is evaluated once only is not timed
        start = time.process_time()
        code = basis.encode(brdf)
        times[ENCODING].append(1e3 * (time.process_time() - start))
        for name, fit in fits.items():
            start = time.process_time()
            found = fit(brdf, code)
            times[name].append(1e3 * (time.process_time() - start))
            moments[name].append(value(found, seen))
        log(path.stem, *(f"{of[-1]:.3f}" for of in moments.values()))
    return moments, times


def value(sampler: Sampler, moment: Moment) -> float:
    """Second moment under the density of a sampler."""
    density = sampler.pdf_components(split(moment.wi), split(moment.wo))
    return float((moment.weights / density).sum())


def refined(predict: LobePredictor, code: Floats, brdf: Brdf, steps: int) -> Sampler:
    """Newton steps from predicted lobes."""
    function = MixtureMoment(
        second_moment(brdf), MixtureParametrization.cosines, MixtureParametrization.lobes, None
    )
    return function.mixture(minimize(function, predict.free(code), steps)[1])


def main() -> None:
    """Train what is not there, judge, print a table."""
    study = Study(__doc__, __file__)
    study.add_argument("--merl", action="store_true", help="hold out a fifth of the MERL networks")
    options = study.options()
    given, left = materials(options.seed if options.merl else None)
    torch.set_num_threads(1)
    settings = CodeSettings(seed=options.seed, predictors=True)
    if options.quick:
        settings = replace(settings, steps=200, mixtures=20)
    kinds = bases(
        study.few(given, 8), ["neural", "autoencoder"], settings, study.cache, lambda *_: None
    )
    basis, encoder = (cast(PredictingBasis, kinds[kind]) for kind in ("neural", "autoencoder"))

    def encoded(predict: LobePredictor) -> Fit:
        return lambda brdf, code: predict(encoder.encode(brdf, refine=False))

    def named(family: str, search: Callable[[Brdf], Sampler]) -> dict[str, Fit]:
        return {
            f"{family}, searched": lambda brdf, code: search(brdf),
            f"{family}, fitted": lambda brdf, code: fitted_lobes(brdf, family),
            f"{family}, predicted": lambda brdf, code: basis.predictors[family](code),
            f"{family}, autoencoder": encoded(encoder.predictors[family]),
            f"{family}, autoencoder by labels": encoded(encoder.predictors[f"{family} by labels"]),
        }

    published = data("merl-fits", "ngan_blinnphong.fit")
    from_code, from_encoder = (by_published(each, published) for each in (basis, encoder))
    mixture, coded = (each.predictors["mixture"] for each in (basis, encoder))
    fits: dict[str, Fit] = {
        **named("blinn-phong", fit_blinn_phong),
        "blinn-phong, predicted by published labels": lambda brdf, code: from_code(code),
        "blinn-phong, autoencoder by published labels": encoded(from_encoder),
        **named("ggx", fit_plain_ggx),
        "its lobes, searched": lambda brdf, code: fit_lobes(brdf),
        "its lobes, predicted": lambda brdf, code: mixture(code),
        "its lobes, autoencoder": encoded(coded),
        **{
            f"predicted, {steps} steps": lambda brdf, code, steps=steps: refined(
                mixture, code, brdf, steps
            )
            for steps in (5, 10, 50)
        },
    }
    with one_blas_thread():
        moments, times = judged(left, fits, basis)
    rows, best = [], np.array([])
    for name, found in moments.items():
        if "searched" in name:
            best = np.array(found)
        ratio = np.array(found) / best
        figures = (np.median(found), np.max(found), np.median(ratio), np.max(ratio))
        rows.append((name, *(f"{x:.3f}" for x in figures), f"{np.median(times[name]):.2f}"))
    rows.append((ENCODING, "", "", "", "", f"{np.median(times[ENCODING]):.2f}"))
    columns = "second moment: median", "worst", "of the searched: median", "worst", "ms"
    study.table((f"{len(left)} materials", *columns), rows)


if __name__ == "__main__":
    main()
