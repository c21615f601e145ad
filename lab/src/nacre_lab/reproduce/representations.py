"""Tables 1 and 3 and figures 2, 5 to 10 and 17: representations of materials, compared."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median

from nacre.errors import NacreError
from nacre.figures.page import Figure
from nacre.formats import identify, load_brdf
from nacre.mitsuba import bsdf
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import load_environment
from nacre.mitsuba.scene import PATH_DEPTH, describe_scene
from nacre.runtime.progress import Progress, named
from nacre_lab.reproduce.error_charts import error_strips, size_plot
from nacre_lab.reproduce.experiment import Experiment, Outcome, Request
from nacre_lab.reproduce.lobes import FIGURES as LOBE_FIGURES
from nacre_lab.reproduce.lobes import lobe_pages, with_lobe_errors
from nacre_lab.reproduce.methods import (
    ENHANCED_SIZES,
    PHONG_SAMPLED,
    SIZES,
    TEXTURE_NETWORK,
    methods,
)
from nacre_lab.reproduce.ray_count import rays_per_path
from nacre_lab.reproduce.spheres import mean_maps, sphere_pages
from nacre_lab.reproduce.study import Study, run
from nacre_lab.reproduce.summary import all_trials, markdown
from nacre_lab.reproduce.throughput import race
from nacre_lab.reproduce.trial import (
    ANGLES,
    HIGHER_IS_BETTER,
    LIGHTS,
    MEASURES,
    TRUTH,
    Method,
    Settings,
)

Pages = Mapping[str, Figure]
"""Matplotlib figures by suffix to the experiment's name."""

TIMES = ("million rays per second", "seconds per million paths", "time relative to GGX")
"""Names of the values from :func:`with_times`."""
_GGX = "Mitsuba's roughconductor"
_ROUNDS, _SPP = 5, 64

_PROTOCOL = (
    "spheres of `nacre compare` (fixed directions of light, no path tracing) instead of the "
    "paper's scene; the materials named below instead of the 100 of MERL; networks with nacre's "
    "recipe (other training directions unless the name says adaptive or uniform, another "
    "initialization and learning rate, no ReLU on the output in training); "
    "analytic models fitted by nacre, with a loss gain of 16 unless the name says otherwise; "
    "published parameters if --published has tables of them"
)
_SEEN = "enhanced-675", "nbrdf-675", "published", "pca", "npf", "sgd", "ggx", "rgl-48k"
OPTIONS = frozenset(("methods", "environment", "size", "quick", "seed", "folder", "fresh", "jobs"))
"""Fields of a request that every comparison uses."""


def _compared(names: Iterable[str]) -> list[str]:
    """All quick methods, with networks of the paper's size only."""
    sizes = {*SIZES, *ENHANCED_SIZES} - {"nbrdf-675", "enhanced-675"}
    return [name for name in _quick(names) if name not in sizes]


def _fixed(*chosen: str) -> Callable[[Iterable[str]], list[str]]:
    return lambda names: [name for name in chosen if name in names]


def every(names: Iterable[str]) -> list[str]:
    return [name for name in names if name != TRUTH]


def _quick(names: Iterable[str]) -> list[str]:
    """All methods that fit a material in seconds."""
    return [name for name in every(names) if name != TEXTURE_NETWORK]


def _both_lights(study: Study, chosen: Sequence[str]) -> Pages:
    figures = sphere_pages(study, chosen, *LIGHTS)
    return {str(n) if len(figures) > 1 else "": figure for n, figure in enumerate(figures, 1)}


def _spheres(study: Study, chosen: Sequence[str]) -> Pages:
    pages = {}
    for light in LIGHTS:
        figures = sphere_pages(study, chosen, light)
        for number, figure in enumerate(figures, 1):
            pages[f"{light}-{number}" if len(figures) > 1 else light] = figure
    return pages


@dataclass(frozen=True, kw_only=True)
class Comparison(Experiment):
    """A table or figure that compares methods on materials.

    Parameters
    ----------
    choose
        Chooses the default methods from all names.
    draw
        Draws its pictures from a study and methods.
    tables
        Figures in each table, by title.
    anisotropic
        Whether it is for anisotropic materials only.
    prepare
        Turns the results of trials into what the tables show, and reports progress.
    paper
        The paper's figures in Markdown, to put below the tables.
    """

    differs: str = _PROTOCOL
    choose: Callable[[Iterable[str]], list[str]]
    draw: Callable[[Study, Sequence[str]], Pages] = lambda study, chosen: {}
    tables: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: _TABLES)
    anisotropic: bool = False
    prepare: Callable[[Study, Sequence[str], Progress], Study] = lambda study, *_: study
    paper: str = ""

    heeds: frozenset[str] = OPTIONS | {"published", "basis", "epochs"}

    def run(self, name: str, request: Request) -> Outcome:
        for folder in request.published:
            if not folder.is_dir():
                raise NacreError(
                    f"{folder}: is not a folder; --published takes folders of networks and tables"
                )
        if self.anisotropic:
            for path in request.files:
                if load_brdf(path).isotropic:
                    raise NacreError(f"{path}: is isotropic; {name} is for anisotropic materials")
        lighting = load_environment(request.environment) if request.environment else None
        settings = Settings(
            request.size or Settings.size,
            epochs=request.epochs or Settings.epochs,
            seed=request.seed,
            environment=lighting,
        )
        if request.quick:
            settings = replace(settings, size=64, directions=128, epochs=20, samples=160_000)
        known, settings = self.candidates(request, settings)
        chosen = request.known_methods(known) or self.choose(known)
        compared = {TRUTH: methods(settings)[TRUTH], **{m: known[m] for m in chosen if m != TRUTH}}
        study = run(
            request.files,
            compared,
            settings,
            request.cache,
            jobs=request.jobs,
            progress=request.progress,
        )
        if not any(method != TRUTH for _, method in study.trials):
            reasons = sorted(set(study.skipped.values()))
            raise NacreError(f"nothing could be tried: {'; '.join(reasons)}")
        return self.outcome(name, study, chosen, request.progress)

    def candidates(
        self, request: Request, settings: Settings
    ) -> tuple[Mapping[str, Method], Settings]:
        """The known methods by name, and the settings of all trials."""
        return methods(settings, request.published, request.basis), settings

    def results(self, study: Study, chosen: Sequence[str]) -> list[str]:
        """Tables in Markdown with their titles, one after the other."""
        parts = []
        for title, figures in self.tables.items():
            parts += [f"## {title}\n", markdown(study, chosen, figures, title)]
        return parts

    def outcome(
        self, name: str, study: Study, chosen: Sequence[str], progress: Progress
    ) -> Outcome:
        """Tables and pages of a study with trials of the truth and the chosen methods."""
        prepared = self.prepare(study, chosen, progress)
        parts = [
            f"# {name}: {self.title}\n",
            "Mean ± standard deviation over materials, and the worst value with its material.\n",
        ]
        parts += self.results(prepared, chosen)
        if self.paper:
            parts += ["## the paper, of other data\n", self.paper]
        facts = {"Settings": study.settings.summary(), "Materials": _by_format(study.materials)}
        left_out = study.left_out()
        text = "\n".join([*parts, self.describe(facts, left_out)])
        pages = self.draw(study, chosen)
        return Outcome(pages, *all_trials(prepared, chosen), text, left_out=left_out)


def _by_format(materials: Mapping[str, Path]) -> str:
    """Names of materials, followed by the format of their files, which tells what the truth is."""
    found: dict[str, list[str]] = {}
    for name, path in materials.items():
        found.setdefault(identify(path).name, []).append(name)
    return "; ".join(f"{', '.join(names)} ({kind})" for kind, names in found.items())


def with_times(study: Study, chosen: Sequence[str], progress: Progress) -> Study:
    """The same trials with rendering times instead of their figures.

    The ball of `nacre render` is path traced, twice as wide as the study's spheres; all methods of
    a material take turns with Mitsuba's own GGX, `roughconductor`. Each representation is sampled
    by its own sampler. Rays are those along paths and those to lights; the number per path is
    counted apart from the timing.
    """
    mi = mitsuba()
    size = 2 * study.settings.size
    paths = size * size * _SPP / 1e6
    trials = {}
    for material in study.materials:
        found = [method for method in chosen if (material, method) in study.trials]
        scenes_of = {method: bsdf(study.fitted(material, method)) for method in found}
        scenes_of[_GGX] = {"type": "roughconductor", "alpha": 0.2, "distribution": "ggx"}
        scenes = {
            name: mi.load_dict(describe_scene(one, size=(size, size)))
            for name, one in scenes_of.items()
        }
        report = named(progress, material)
        results = race(scenes, _GGX, rounds=_ROUNDS, spp=_SPP, progress=report)
        for done, method in enumerate(found, 1):
            rays = paths * rays_per_path(scenes[method], PATH_DEPTH)
            report("counting rays", done, len(found), method)
            seconds, ratios = results[method]
            values = rays / seconds, seconds / paths, 1.0 / median(ratios)
            figures = dict(zip(TIMES, values, strict=True))
            trials[material, method] = replace(study.trials[material, method], figures=figures)
    return replace(study, trials=trials)


_TABLES: Mapping[str, tuple[str, ...]] = {
    **{light: tuple(f"{light} {measure}" for measure in MEASURES) for light in LIGHTS},
    "angles": ANGLES,
}

_PAPER_TIMES = """\
| representation | million rays per second | KB |
|---|---:|---:|
| Bagher et al. | 10.64 | 0.13 |
| RGL | 10.66 | 48.0 |
| NBRDF + PhongIS | 12.50 | 2.70 |
| Cook-Torrance | 13.59 | 0.03 |
| Dupuy et al. | 14.05 | 2.16 |
| Low et al. | 15.13 | 0.03 |
| GGX | 16.82 | 0.03 |
| NPF | – | 3.20 |
"""

TABLE1 = Comparison(
    title="errors of reconstruction, and of adaptive and uniform training directions",
    choose=_compared,
)
TABLE3 = Comparison(
    title="rendering time and memory",
    choose=_fixed(
        *(PHONG_SAMPLED, "nbrdf-675", "enhanced-675", "cook-torrance", "ggx", "abc-microfacet"),
        *("sgd", "npf", "power-iterations", "tabulated-microfacets", "rgl-48k"),
    ),
    differs="another machine, and a later Mitsuba that compiles the whole scene; times are "
    "relative to Mitsuba's own GGX in the same run; the ball of `nacre render` instead of the "
    "paper's scene; nacre's fits, plugins and samplers for all, except that "
    f"{PHONG_SAMPLED} has the paper's sampler and power-iterations the normals of its own tables; "
    f"the lobe of {PHONG_SAMPLED} is found by a search: a predicted one takes the same time",
    tables={"times": TIMES},
    prepare=with_times,
    paper=_PAPER_TIMES,
)
FIG2 = Comparison(
    title="the network of 2019 for textures, on one reflectance",
    choose=_fixed(TEXTURE_NETWORK, "stereographic-685", "nbrdf-675"),
    draw=_both_lights,
    differs="spheres of `nacre compare` instead of the paper's scene; the materials named below; "
    "the network sees each at the pairs of directions of the Bonn dome, up to 75 degrees, since "
    "the paper does not say which it used; its encoder's sizes and its training are nacre's; "
    "beside it are a small network with the same inputs, and an NBRDF",
)
FIG5 = Comparison(
    title="materials from other databases",
    choose=_fixed("nbrdf-675", "enhanced-675"),
    draw=_both_lights,
    differs=_PROTOCOL.replace(
        "the 100 of MERL", "four from the RGL database and two from Nielsen et al."
    )
    + "; for a published network, the network itself is the truth",
)
FIG6 = Comparison(title="materials with several methods", choose=_fixed(*_SEEN), draw=_spheres)
FIG7 = Comparison(
    title="SSIM over the picture, mean over materials",
    choose=_compared,
    draw=lambda study, chosen: {light: mean_maps(study, chosen, light) for light in LIGHTS},
)
FIG8 = Comparison(
    title="lobes in the plane of incidence",
    choose=_fixed("enhanced-675", "nbrdf-675", "npf", "published", "sgd", "rgl-48k"),
    draw=lobe_pages,
    differs="lights at 15, 45, 75 and 80 degrees; other materials than grease-covered-steel "
    "and black-oxidized-steel unless these are given; more methods than NPF and the network",
    tables={"mean |log10 g − log10 f| of luminance, in decades": LOBE_FIGURES},
    prepare=with_lobe_errors,
)
FIG9 = Comparison(
    title="anisotropic materials",
    choose=_fixed(
        *("enhanced-675", "enhanced-2625", "nbrdf-675", "nbrdf-2625"), *("ggx-anisotropic", "ggx")
    ),
    draw=_spheres,
    differs=_PROTOCOL.replace("the 100 of MERL", "the 11 anisotropic ones in the RGL database"),
    anisotropic=True,
)
FIG10 = Comparison(
    title="SSIM of every material with every method",
    choose=_compared,
    draw=lambda study, chosen: {"": error_strips(study, chosen)},
)
FIG17 = Comparison(
    title="fidelity against memory",
    choose=_quick,
    draw=lambda study, chosen: {x: size_plot(study, chosen, x) for x in LIGHTS},
    tables={"SSIM and PSNR": tuple(f"{x} {m}" for x in LIGHTS for m in HIGHER_IS_BETTER)},
)
