"""Figures 13 to 16: noise in pictures of two scenes, by sampler."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.figures.page import FAINT, Figure, Page
from nacre.formats import load_brdf
from nacre.latent.predicting import PredictingBasis
from nacre_lab.reproduce.chart import charts, dress, line_style
from nacre_lab.reproduce.codes import CodeSettings
from nacre_lab.reproduce.experiment import Experiment, LeftOut, Outcome, Request
from nacre_lab.reproduce.kitchen import describe_kitchen
from nacre_lab.reproduce.kitchen_page import kitchen_page
from nacre_lab.reproduce.noise import MEASURES, Describe, NoiseSettings, NoiseStudy, run_noise
from nacre_lab.reproduce.plates import describe_plates
from nacre_lab.reproduce.samplers import DEFAULT, PREDICTED, SAMPLERS, find_sampler
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.unseen import TooFewError, UnseenBases, separate, unseen_bases

_EDGE, _GAP, _HEAD, _CAPTION = 2.3, 0.06, 0.32, 0.24
"""Inches: width of a picture, space between, and heights of titles and captions."""
_PANEL, _LEGEND_WIDTH = 3.0, 1.9
"""Inches: width and height of a plot, and width of the names of all lines."""

_DIFFERS = (
    "nacre's own scenes; the materials named below instead of the test set of MERL, none of them "
    "used to train its predictor; their f_r is that of the files; labels are lobes of Blinn-Phong "
    "and GGX models fitted by nacre instead of published parameters; the autoencoder is trained by "
    "nacre; blinn-phong and nacre are found by a search for the least variance, and those that end "
    "in -predicted or begin with autoencoder learned to minimize it; errors are those of pictures "
    "after clipping and a gamma of 2.2"
)


@dataclass(frozen=True, kw_only=True)
class NoiseFigure(Experiment):
    """A figure of noise.

    Parameters
    ----------
    scene
        The scene.
    together
        Whether all materials are in one picture, instead of one each.
    draw
        Draws the page from a study and samplers.
    """

    differs: str = _DIFFERS
    scene: Describe
    together: bool
    draw: Callable[[NoiseStudy, Sequence[str]], Figure]
    heeds: frozenset[str] = frozenset(
        ("methods", "basis", "unseen", "steps", "quick", "seed", "folder", "fresh")
    )

    def run(self, name: str, request: Request) -> Outcome:
        chosen = request.known_methods(SAMPLERS)
        files, others = separate(request.files, request.unseen)
        brdfs = {path.stem: load_brdf(path) for path in files}
        left_out: list[LeftOut] = []
        optional = not chosen
        if optional:  # codes are for isotropic materials
            coded = all(brdf.isotropic for brdf in brdfs.values())
            chosen = [sampler for sampler in DEFAULT if coded or sampler not in PREDICTED]
        found: dict[str, UnseenBases] = {}
        for kind in dict.fromkeys(PREDICTED[name].kind for name in chosen if name in PREDICTED):
            try:
                found[kind] = _bases(kind, files, others, request)
            except TooFewError as error:
                if not optional:
                    raise
                of_kind = [n for n in chosen if n in PREDICTED and PREDICTED[n].kind == kind]
                chosen = [sampler for sampler in chosen if sampler not in of_kind]
                left_out += [(sampler, str(error), list(brdfs)) for sampler in of_kind]

        def basis_of(brdf: Brdf, kind: str) -> PredictingBasis:
            return found[kind].of(brdf)

        settings = NoiseSettings(seed=request.seed)
        if request.quick:
            settings = replace(settings, size=(180, 120), counts=(1, 4, 16, 64), reference=512)
        alone = {key: [brdf] for key, brdf in brdfs.items()}
        prints = {kind: of.fingerprint() for kind, of in found.items()}
        study = run_noise(
            self.scene,
            {"all": list(brdfs.values())} if self.together else alone,
            {name: find_sampler(name, basis_of) for name in chosen},
            settings,
            request.cache,
            request.progress,
            fingerprints={n: prints[PREDICTED[n].kind] for n in chosen if n in PREDICTED},
        )
        facts = {
            "Settings": f"{settings.size[0]} x {settings.size[1]} pixels, reference of "
            f"{settings.reference} samples, seed {settings.seed}",
            "Materials": ", ".join(brdfs),
            **{f"Basis {kind!r}": of.about for kind, of in found.items()},
        }
        text = (
            f"# {name}: {self.title}\n\nMeans over pictures, at {settings.shown} samples per "
            f"pixel.\n\n{markdown_table(*noise_table(study, chosen))}\n"
            f"{self.describe(facts, left_out)}"
        )
        columns = ["picture", "sampler", "samples", "seconds", *MEASURES]
        rows = all_errors(study, chosen)
        return Outcome({"": self.draw(study, chosen)}, columns, rows, text, left_out=left_out)


def _bases(
    kind: str, files: Sequence[Path], others: Sequence[Path], request: Request
) -> UnseenBases:
    """Bases of a kind that have not seen their materials; cached with the results."""
    settings = CodeSettings(seed=request.seed, predictors=True)
    if request.steps is not None:
        settings = replace(settings, steps=request.steps)
    elif request.quick:
        settings = settings.quick()
    given = request.find_basis() if request.basis else None
    if given is not None and not given.predictors:
        raise NacreError(
            f"{request.basis}: predicts no lobes; train one with nacre latent train --model neural"
        )
    return unseen_bases(kind, files, others, given, settings, request.cache, request.progress)


def picture_page(study: NoiseStudy, samplers: Sequence[str]) -> Figure:
    """The reference and a picture for every sampler, one row for each subject."""
    columns, rows = 1 + len(samplers), len(study.references)
    settings = study.settings
    tall = _EDGE * settings.size[1] / settings.size[0]
    page = Page(columns * (_EDGE + _GAP) + _GAP, rows * (tall + _CAPTION) + _HEAD, paper="white")
    at = settings.counts.index(settings.shown)
    titles = [f"reference, {settings.reference} samples"]
    titles += [f"{sampler}, {settings.shown} samples" for sampler in samplers]
    for j, title in enumerate(titles):
        page.text(_GAP + j * (_EDGE + _GAP), _HEAD - 0.1, title, limit=_EDGE)
    for i, (name, truth) in enumerate(study.references.items()):
        y = _HEAD + i * (tall + _CAPTION)
        shown = [(truth, name)]
        for found in (study.found[name, sampler] for sampler in samplers):
            errors = f"RMSE {found.errors['RMSE'][at]:.4f}, {found.seconds[at]:.1f} s"
            shown.append((found.picture, errors))
        for j, (picture, caption) in enumerate(shown):
            x = _GAP + j * (_EDGE + _GAP)
            page.image(x, y, _EDGE, tall, tone_map(picture), smooth=False)
            page.text(x, y + tall + 0.04, caption, 8.0, FAINT, va="top", limit=_EDGE)
    return page.figure


def error_page(study: NoiseStudy, samplers: Sequence[str]) -> Figure:
    """Mean errors of all pictures against samples per pixel, and RMSE against seconds."""
    shown = [
        *((measure, "samples per pixel") for measure in MEASURES),
        ("RMSE", "seconds per picture"),
    ]
    figure, panels = charts(len(shown), _PANEL * len(shown) + _LEGEND_WIDTH, _PANEL * 1.1)
    for axes, (measure, label) in zip(panels, shown, strict=True):
        for index, sampler in enumerate(samplers):
            x = study.seconds(sampler) if label.startswith("seconds") else study.settings.counts
            axes.plot(x, study.mean(sampler, measure), label=sampler, **line_style(index))
        psnr = measure == "PSNR"
        dress(axes, "PSNR, dB" if psnr else measure, label, log="" if psnr else "y")
        axes.set_xscale("log", base=2)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right", fontsize=8, frameon=False)
    return figure


def equal_time(study: NoiseStudy, sampler: str, seconds: float) -> float:
    """Mean RMSE of a sampler after a time, interpolated between sample counts in log-log."""
    x, y = np.log(study.seconds(sampler)), np.log(study.mean(sampler, "RMSE"))
    return float(np.exp(np.interp(np.log(seconds), x, y)))


def noise_table(study: NoiseStudy, samplers: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Head and rows: errors and seconds at the count `shown`, and RMSE at equal time.

    The time is that of the fastest sampler at that count.
    """
    at = study.settings.counts.index(study.settings.shown)
    seconds = {sampler: float(study.seconds(sampler)[at]) for sampler in samplers}
    budget = min(seconds.values())
    rows = []
    for sampler in samplers:
        *means, psnr = (float(study.mean(sampler, measure)[at]) for measure in MEASURES)
        cells = [*(f"{value:.4f}" for value in means), f"{psnr:.1f}", f"{seconds[sampler]:.2f}"]
        rows.append([sampler, *cells, f"{equal_time(study, sampler, budget):.4f}"])
    return ["sampler", *MEASURES, "seconds", f"RMSE after {budget:.2f} s"], rows


def all_errors(study: NoiseStudy, samplers: Sequence[str]) -> list[Sequence[object]]:
    """Every error of every picture: picture, sampler, samples, seconds, measures."""
    rows: list[Sequence[object]] = []
    for name, sampler in product(study.references, samplers):
        found = study.found[name, sampler]
        columns = study.settings.counts, found.seconds, *(found.errors[m] for m in MEASURES)
        rows += [[name, sampler, *values] for values in zip(*columns, strict=True)]
    return rows


_PLATES: dict[str, Any] = {"scene": describe_plates, "together": False}
_KITCHEN: dict[str, Any] = {"scene": describe_kitchen, "together": True}
FIG13 = NoiseFigure(title="plates with several samplers", draw=picture_page, **_PLATES)
FIG14 = NoiseFigure(title="errors of the plates", draw=error_page, **_PLATES)
FIG15 = NoiseFigure(title="a kitchen with several samplers", draw=kitchen_page, **_KITCHEN)
FIG16 = NoiseFigure(title="errors of the kitchen", draw=error_page, **_KITCHEN)
