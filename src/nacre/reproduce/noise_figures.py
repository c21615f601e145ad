"""Figures 13 to 16: noise of pictures of two scenes, by the way their materials are sampled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.figures.chart import COLORS, charts, dress
from nacre.figures.page import FAINT, Page
from nacre.formats import load_brdf
from nacre.render.kitchen import describe_kitchen
from nacre.render.plates import describe_plates
from nacre.reproduce.experiment import Experiment, Outcome, Request
from nacre.reproduce.noise import MEASURES, Describe, NoiseSettings
from nacre.reproduce.noise_study import NoiseStudy, run_noise
from nacre.reproduce.samplers import DEFAULT, PREDICTED, SAMPLERS, find_sampler
from nacre.reproduce.tables import markdown_table

_EDGE, _GAP, _HEAD, _CAPTION = 2.3, 0.06, 0.32, 0.24
"""Inches: width of a picture, space between, and heights of titles and captions."""
_PANEL = 3.0
"""Inches: width and height of a plot."""

_DIFFERS = (
    "scenes of nacre's own; the materials named below in place of the test set of MERL; their f_r "
    "is that of the files; what predicts lobes is trained on their variance in place of labels; "
    "fitted lobes are found by search; errors are of pictures after clipping and a gamma of 2.2"
)


@dataclass(frozen=True, kw_only=True)
class NoiseFigure(Experiment):
    """A figure of noise.

    Parameters
    ----------
    title, differs
        See :class:`nacre.reproduce.experiment.Experiment`.
    scene
        The scene.
    together
        Whether all materials are in one picture, or each in one of its own.
    draw
        Its page, of a study and samplers.
    """

    differs: str = _DIFFERS
    scene: Describe
    together: bool
    draw: Callable[[NoiseStudy, Sequence[str]], Any]

    options = frozenset(("methods", "basis", "quick", "seed", "folder", "fresh"))

    def run(self, name: str, request: Request) -> Outcome:
        """See :class:`nacre.reproduce.experiment.Experiment`."""
        basis = request.find_basis()
        if not basis.predictors:
            raise NacreError(
                f"{request.basis}: predicts no lobes; make it by nacre latent train --model neural"
            )
        brdfs: dict[str, Brdf] = {path.stem: load_brdf(path) for path in request.files}
        chosen = request.known_methods(SAMPLERS)
        if not chosen:  # codes are for isotropic materials
            coded = all(brdf.isotropic for brdf in brdfs.values())
            chosen = [sampler for sampler in DEFAULT if coded or sampler not in PREDICTED]
        settings = NoiseSettings(seed=request.seed)
        if request.quick:
            settings = replace(settings, size=(180, 120), counts=(1, 4, 16, 64), reference=512)
        every = {"all": list(brdfs.values())}
        study = run_noise(
            self.scene,
            every if self.together else {key: [brdf] for key, brdf in brdfs.items()},
            {name: find_sampler(name, basis) for name in chosen},
            settings,
            request.cache,
            request.progress,
            fingerprints=dict.fromkeys(PREDICTED, basis.fingerprint(predictors=True)),
        )
        facts = {
            "Settings": f"{settings.size[0]} x {settings.size[1]} pixels, reference of "
            f"{settings.reference} samples, seed {settings.seed}",
            "Materials": ", ".join(brdfs),
        }
        text = (
            f"# {name}: {self.title}\n\nMeans over pictures, at {settings.shown} samples per "
            f"pixel.\n\n{markdown_table(*noise_table(study, chosen))}\n{self.describe(facts, ())}"
        )
        columns = ["picture", "sampler", "samples", "seconds", *MEASURES]
        return Outcome({"": self.draw(study, chosen)}, columns, all_errors(study, chosen), text)


def picture_page(study: NoiseStudy, samplers: Sequence[str]) -> Any:
    """The reference and a picture by every sampler, a row for each thing that is shown.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    columns, rows = 1 + len(samplers), len(study.references)
    width, height = study.settings.size
    tall = _EDGE * height / width
    page = Page(columns * (_EDGE + _GAP) + _GAP, rows * (tall + _CAPTION) + _HEAD, paper="white")
    at = study.settings.counts.index(study.settings.shown)
    for i, (name, truth) in enumerate(study.references.items()):
        y = _HEAD + i * (tall + _CAPTION)
        for j, sampler in enumerate((None, *samplers)):
            x = _GAP + j * (_EDGE + _GAP)
            if sampler is None:
                picture, title = truth, f"reference, {study.settings.reference} samples"
                caption = name
            else:
                found = study.found[name, sampler]
                picture, title = found.picture, f"{sampler}, {study.settings.shown} samples"
                caption = f"RMSE {found.errors['RMSE'][at]:.4f}, {found.seconds[at]:.1f} s"
            page.image(x, y, _EDGE, tall, tone_map(picture), smooth=False)
            if i == 0:
                page.text(x, _HEAD - 0.1, title, limit=_EDGE)
            page.text(x, y + tall + 0.04, caption, 8.0, FAINT, va="top", limit=_EDGE)
    return page.figure


def error_page(study: NoiseStudy, samplers: Sequence[str]) -> Any:
    """Mean errors of all pictures against samples per pixel, and RMSE against seconds.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    count = len(MEASURES) + 1
    figure, panels = charts(count, _PANEL * count, _PANEL * 1.1)
    for k, axes in enumerate(panels):
        measure = MEASURES[k] if k < len(MEASURES) else "RMSE"
        for index, sampler in enumerate(samplers):
            x = study.settings.counts if k < len(MEASURES) else study.seconds(sampler)
            values = study.mean(sampler, measure)
            style = {"color": COLORS[index % len(COLORS)], "marker": "o", "markersize": 3}
            axes.plot(x, values, label=sampler, linewidth=1.2, **style)
        label = "samples per pixel" if k < len(MEASURES) else "seconds a picture"
        psnr = measure == "PSNR"
        dress(axes, "PSNR, dB" if psnr else measure, label, log="" if psnr else "y")
        axes.set_xscale("log", base=2)
    axes.legend(fontsize=8, frameon=False)
    return figure


def equal_time(study: NoiseStudy, sampler: str, seconds: float) -> float:
    """Mean RMSE of a sampler after a time, between the counts of samples in log-log."""
    x, y = np.log(study.seconds(sampler)), np.log(study.mean(sampler, "RMSE"))
    return float(np.exp(np.interp(np.log(seconds), x, y)))


def noise_table(study: NoiseStudy, samplers: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Head and rows: errors at the count that is shown, its seconds, and RMSE at equal time.

    The time is that of the fastest sampler at that count.
    """
    at = study.settings.counts.index(study.settings.shown)
    budget = min(float(study.seconds(sampler)[at]) for sampler in samplers)
    rows = []
    for sampler in samplers:
        means = [float(study.mean(sampler, measure)[at]) for measure in MEASURES]
        cells = [f"{value:.4f}" for value in means[:-1]] + [f"{means[-1]:.1f}"]
        seconds = float(study.seconds(sampler)[at])
        same = equal_time(study, sampler, budget)
        rows.append([sampler, *cells, f"{seconds:.2f}", f"{same:.4f}"])
    return ["sampler", *MEASURES, "seconds", f"RMSE after {budget:.2f} s"], rows


def all_errors(study: NoiseStudy, samplers: Sequence[str]) -> list[Sequence[object]]:
    """Every error of every picture: picture, sampler, samples, seconds, measures."""
    rows: list[Sequence[object]] = []
    for name in study.references:
        for sampler in samplers:
            found = study.found[name, sampler]
            for k, count in enumerate(study.settings.counts):
                values = (found.seconds[k], *(found.errors[m][k] for m in MEASURES))
                rows.append([name, sampler, count, *values])
    return rows


FIG13 = NoiseFigure(
    title="plates by several samplers", scene=describe_plates, together=False, draw=picture_page
)
FIG14 = NoiseFigure(
    title="errors of the plates", scene=describe_plates, together=False, draw=error_page
)
FIG15 = NoiseFigure(
    title="a kitchen by several samplers",
    scene=describe_kitchen,
    together=True,
    draw=picture_page,
)
FIG16 = NoiseFigure(
    title="errors of the kitchen", scene=describe_kitchen, together=True, draw=error_page
)
