"""Figures 13 to 16 by name: two scenes, and ways to sample their materials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nacre.brdf import Brdf
from nacre.figures.plot import write_plot
from nacre.formats import load_brdf
from nacre.io.files import atomic_path
from nacre.latent.basis import LatentBasis
from nacre.render.kitchen import describe_kitchen
from nacre.render.plates import describe_plates
from nacre.reproduce.noise import Describe, NoiseSettings
from nacre.reproduce.noise_pages import error_page, noise_table, picture_page, write_noise
from nacre.reproduce.noise_study import NoiseStudy, run_noise
from nacre.reproduce.samplers import PREDICTED, sampler
from nacre.reproduce.summary import table_row
from nacre.runtime.progress import Progress

DIFFERS = (
    "scenes of nacre's own; the materials named below in place of the test set of MERL; their f_r "
    "is that of the files; what predicts lobes is trained on their variance in place of labels; "
    "fitted lobes are found by search; errors are of pictures after clipping and a gamma of 2.2"
)


@dataclass(frozen=True)
class NoiseExperiment:
    """A figure of noise.

    Parameters
    ----------
    title
        What it shows.
    describe
        The scene.
    together
        Whether all materials are in one picture, or each in one of its own.
    draw
        Its page, of a study and samplers.
    """

    title: str
    describe: Describe
    together: bool
    draw: Callable[[NoiseStudy, Sequence[str]], Any]

    def run(
        self,
        files: Sequence[Path],
        samplers: Sequence[str],
        settings: NoiseSettings,
        folder: Path,
        progress: Progress,
        *,
        basis: LatentBasis | None = None,
        fresh: bool = False,
    ) -> NoiseStudy:
        """Render what is not in the folder yet, or all.

        Raises
        ------
        NacreError
            If a file cannot be read, its material not rendered, or lobes are to be predicted
            without a basis that does.
        """
        brdfs: dict[str, Brdf] = {path.stem: load_brdf(path) for path in files}
        every = {"all": list(brdfs.values())}
        groups = every if self.together else {name: [brdf] for name, brdf in brdfs.items()}
        chosen = {name: sampler(name, basis) for name in samplers}
        marks = {}
        if basis is not None:
            marks = dict.fromkeys(PREDICTED, basis.fingerprint(predictors=True))
        return run_noise(
            self.describe, groups, chosen, settings, folder, progress, marks=marks, fresh=fresh
        )

    def write(
        self, name: str, study: NoiseStudy, samplers: Sequence[str], files: Sequence[Path], to: Path
    ) -> list[Path]:
        """Write the CSV, the Markdown and the picture; returns their paths.

        Raises
        ------
        FormatError
            If a file cannot be written.
        MissingExtraError
            If Matplotlib is not installed.
        """
        paths = [to / f"{name}{ending}" for ending in (".csv", ".md", ".png")]
        write_noise(study, samplers, paths[0])
        head, rows = noise_table(study, samplers)
        lines = [table_row(cells) for cells in (head, ["---"] * len(head), *rows)]
        settings = study.settings
        text = (
            f"# {name}: {self.title}\n\nMeans over pictures, at {settings.shown} samples per "
            "pixel.\n\n" + "\n".join(lines) + "\n\n"
            f"**Settings:** {settings.size[0]} x {settings.size[1]} pixels, reference of "
            f"{settings.reference} samples, seed {settings.seed}.\n\n"
            f"**Differs from the paper:** {DIFFERS}.\n\n"
            f"**Materials:** {', '.join(path.stem for path in files)}.\n"
        )
        with atomic_path(paths[1]) as temporary:
            temporary.write_text(text, encoding="utf-8")
        write_plot(self.draw(study, samplers), paths[2])
        return paths


NOISE_EXPERIMENTS: Mapping[str, NoiseExperiment] = {
    "fig13": NoiseExperiment("plates by several samplers", describe_plates, False, picture_page),
    "fig14": NoiseExperiment("errors of the plates", describe_plates, False, error_page),
    "fig15": NoiseExperiment("a kitchen by several samplers", describe_kitchen, True, picture_page),
    "fig16": NoiseExperiment("errors of the kitchen", describe_kitchen, True, error_page),
}
"""Every experiment by name."""
