"""The paper's tables and figures by name: what each compares, and how it is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nacre.figures.plot import write_plot
from nacre.io.files import atomic_path
from nacre.reproduce.errors import error_strips
from nacre.reproduce.lobes import FIGURES as LOBE_FIGURES
from nacre.reproduce.lobes import lobe_pages, with_lobe_errors
from nacre.reproduce.methods import ENHANCED_SIZES, SIZES, TRUTH
from nacre.reproduce.sizes import footprint_plot
from nacre.reproduce.speed import FIGURES as SPEED_FIGURES
from nacre.reproduce.speed import with_times
from nacre.reproduce.spheres import mean_maps, sphere_pages
from nacre.reproduce.study import Study
from nacre.reproduce.summary import markdown, write_csv
from nacre.reproduce.trial import ANGLES, HIGHER_IS_BETTER, LIGHTS, MEASURES
from nacre.runtime.progress import Progress, silent

Pages = Mapping[str, Any]
"""Matplotlib figures by what is added to the experiment's name."""

_PROTOCOL = (
    "spheres of `nacre compare` (fixed directions of light, no path tracing) in place of the "
    "paper's scene; the materials named below in place of the 100 of MERL; networks by nacre's "
    "recipe (other training directions unless the name says adaptive or uniform, another "
    "initialization and learning rate, no ReLU on the output while training); "
    "analytic models fitted by nacre, with a loss gain of 16 unless the name says otherwise, in "
    "place of published parameters"
)
_SEEN = (
    "enhanced-675",
    "nbrdf-675",
    "published",
    "pca",
    "npf",
    "sgd",
    "ggx",
    "rgl-48k",
)


def _compared(names: Iterable[str]) -> list[str]:
    """All methods, of networks only the paper's size."""
    sizes = {TRUTH, *SIZES, *ENHANCED_SIZES} - {"nbrdf-675", "enhanced-675"}
    return [n for n in names if n not in sizes]


def _fixed(*chosen: str) -> Callable[[Iterable[str]], list[str]]:
    return lambda names: [name for name in chosen if name in names]


def _every(names: Iterable[str]) -> list[str]:
    return [name for name in names if name != TRUTH]


def _spheres(study: Study, methods: Sequence[str]) -> Pages:
    pages = {}
    for light in LIGHTS:
        figures = sphere_pages(study, methods, light)
        for number, figure in enumerate(figures, 1):
            pages[f"{light}_{number}" if len(figures) > 1 else light] = figure
    return pages


@dataclass(frozen=True)
class Experiment:
    """One table or figure of the paper.

    Parameters
    ----------
    title
        What it shows.
    choose
        The methods it compares unless others are asked for, from all names.
    draw
        Its pictures, of a study and methods.
    differs
        How the protocol differs from the paper's.
    tables
        Figures in each table, by its title.
    anisotropic
        Whether it is of anisotropic materials only.
    prepare
        Changes what the trials found into what the tables show, and tells how far it is.
    paper
        The paper's own figures in Markdown, to set below the tables.
    """

    title: str
    choose: Callable[[Iterable[str]], list[str]]
    draw: Callable[[Study, Sequence[str]], Pages]
    differs: str = _PROTOCOL
    tables: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: _TABLES)
    anisotropic: bool = False
    prepare: Callable[[Study, Sequence[str], Progress], Study] = lambda study, *_: study
    paper: str = ""

    def write(
        self,
        name: str,
        study: Study,
        methods: Sequence[str],
        folder: Path,
        progress: Progress | None = None,
    ) -> list[Path]:
        """Write the CSV, the Markdown and the pictures, `name` in front of each.

        Parameters
        ----------
        name
            Of the experiment.
        study
            With trials of the methods, and of the truth.
        methods
            What is shown, in this order.
        folder
            Exists.
        progress
            Called while trials become what the tables show.

        Returns
        -------
        list of Path
            What was written.

        Raises
        ------
        FormatError
            If a file cannot be written.
        MissingExtraError
            If Matplotlib is not installed.
        """
        shown = self.prepare(study, methods, progress or silent)
        paths = [folder / f"{name}.csv", folder / f"{name}.md"]
        write_csv(shown, methods, paths[0])
        with atomic_path(paths[1]) as temporary:
            temporary.write_text(self._text(name, shown, methods), encoding="utf-8")
        for addition, figure in self.draw(study, methods).items():
            paths.append(folder / "_".join(part for part in (name, addition) if part))
            paths[-1] = paths[-1].with_name(f"{paths[-1].name}.png")
            write_plot(figure, paths[-1])
        return paths

    def _text(self, name: str, study: Study, methods: Sequence[str]) -> str:
        parts = [f"# {name}: {self.title}\n"]
        parts.append(
            "Mean ± standard deviation over materials; the worst material, and which one it is.\n"
        )
        for title, figures in self.tables.items():
            parts += [f"## {title}\n", markdown(study, methods, figures, title)]
        if self.paper:
            parts += ["## the paper, of other data\n", self.paper]
        parts.append(f"**Settings:** {study.settings.summary()}.\n")
        parts.append(f"**Differs from the paper:** {self.differs}.\n")
        parts.append(f"**Materials:** {', '.join(study.materials)}.\n")
        if left_out := study.left_out():
            parts.append("**Left out:**\n")
            parts += [f"- {m}: {why} ({', '.join(where)})" for m, why, where in left_out]
            parts.append("")
        return "\n".join(parts)


_TABLES: Mapping[str, tuple[str, ...]] = {
    **{light: tuple(f"{light} {measure}" for measure in MEASURES) for light in LIGHTS},
    "angles": ANGLES,
}

_PAPER_CODES = """\
| code of 32 values | MAE | RMSE | SSIM |
|---|---:|---:|---:|
| NBRDF autoencoder | 0.0178 ± 0.013 | 0.0194 ± 0.014 | 0.968 ± 0.031 |
| PCA (Nielsen et al. 2015) | 0.0199 ± 0.008 | 0.0227 ± 0.009 | 0.982 ± 0.007 |
"""

EXPERIMENTS: Mapping[str, Experiment] = {
    "table1": Experiment(
        "errors of reconstruction, and of adaptive and uniform training directions",
        _compared,
        lambda study, methods: {},
    ),
    "table2": Experiment(
        "codes of materials that were held out",
        _every,
        lambda study, methods: {},
        "the data differ, so the paper's figures cannot be set beside these: the materials named "
        "below, a fifth of those given, which the bases were not trained on, in place of all of "
        "MERL; spheres of `nacre compare` (fixed directions of light, no path tracing) in place of "
        "the paper's scene; nacre's own training of the autoencoder; more codes than the two",
        {light: tuple(f"{light} {m}" for m in ("MAE", "RMSE", "SSIM", "PSNR")) for light in LIGHTS},
        paper=_PAPER_CODES,
    ),
    "table3": Experiment(
        "time of rendering and memory",
        _fixed(
            "nbrdf-675",
            "enhanced-675",
            "cook-torrance",
            "ggx",
            "abc-microfacet",
            "sgd",
            "npf",
            "tabulated-microfacets",
            "rgl-48k",
        ),
        lambda study, methods: {},
        "times of whole path-traced pictures, relative to Mitsuba's own GGX in the same run, in "
        "place of rays a second; the ball of `nacre render` in place of the paper's scene; nacre's "
        "fits, plugins and samplers for all",
        {"times": SPEED_FIGURES},
        prepare=with_times,
    ),
    "fig6": Experiment("materials by several methods", _fixed(*_SEEN), _spheres),
    "fig7": Experiment(
        "SSIM over the picture, mean of the materials",
        _compared,
        lambda study, methods: {light: mean_maps(study, methods, light) for light in LIGHTS},
    ),
    "fig8": Experiment(
        "lobes in the plane of incidence",
        _fixed("enhanced-675", "nbrdf-675", "npf", "published", "sgd", "rgl-48k"),
        lobe_pages,
        "lights at 15, 45, 75 and 80 degrees; other materials than grease-covered-steel and "
        "black-oxidized-steel unless these are given; more methods than NPF and the network",
        {"mean |log10 g − log10 f| of luminance, in decades": LOBE_FIGURES},
        prepare=with_lobe_errors,
    ),
    "fig9": Experiment(
        "anisotropic materials",
        _fixed(
            "enhanced-675", "enhanced-2625", "nbrdf-675", "nbrdf-2625", "ggx-anisotropic", "ggx"
        ),
        _spheres,
        _PROTOCOL.replace("the 100 of MERL", "the 11 anisotropic ones of the RGL database"),
        anisotropic=True,
    ),
    "fig10": Experiment(
        "SSIM of every material by every method",
        _compared,
        lambda study, methods: {"": error_strips(study, methods)},
    ),
    "fig17": Experiment(
        "fidelity against memory",
        _every,
        lambda study, methods: {light: footprint_plot(study, methods, light) for light in LIGHTS},
        tables={"SSIM and PSNR": tuple(f"{x} {m}" for x in LIGHTS for m in HIGHER_IS_BETTER)},
    ),
}
"""Every experiment by name."""
