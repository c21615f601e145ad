"""Every table and figure by name: what it shows, for which methods, and how it differs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from nacre.errors import NacreError
from nacre_lab.reproduce.experiment import Experiment, Outcome, Request
from nacre_lab.reproduce.textures.angles import TEXELS, fig7
from nacre_lab.reproduce.textures.filtering import fig9
from nacre_lab.reproduce.textures.map import tsne
from nacre_lab.reproduce.textures.materials import collect, separate
from nacre_lab.reproduce.textures.methods import KINDS, Method, TrainingSettings, find
from nacre_lab.reproduce.textures.quilting_figure import fig10
from nacre_lab.reproduce.textures.rendering import SIZE
from nacre_lab.reproduce.textures.rendering_figures import fig5, fig6
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.table import table1
from nacre_lab.reproduce.textures.texture_figures import fig4, fig8
from nacre_lab.reproduce.textures.training_figures import decoder, training
from nacre_lab.reproduce.textures.trainings import training_table
from nacre_lab.reproduce.textures.video import video

_ALWAYS = "the given textures; networks are trained as the table says, the paper's for 1000 epochs"
_QUICK_TEXELS = 48
"""Texels of each texture at which a quick run computes errors."""
_LENGTHS = ("steps", "epochs", "minutes")
_OPTIONS = frozenset(
    ("methods", "unseen", "recipe", *_LENGTHS, "device", "quick", "seed", "folder", "fresh")
)
_RENDERED = _OPTIONS | {"size"}
_CUSTOM = "we chose the layers of the encoder of 2019"


@dataclass(frozen=True, kw_only=True)
class TextureExperiment(Experiment):
    """A table or figure of textures.

    Parameters
    ----------
    methods
        Names of the methods compared by default.
    make
        Makes its table in Markdown, rows and pages.
    """

    methods: tuple[str, ...]
    make: Callable[[Study, Sequence[Method]], Outcome]
    heeds: frozenset[str] = _OPTIONS

    def run(self, name: str, request: Request) -> Outcome:
        methods = [find(method) for method in request.methods or self.methods]
        settings = TrainingSettings(seed=request.seed)
        if request.quick:
            settings = TrainingSettings.quick(request.seed)
        lengths = {name: getattr(request, name) for name in _LENGTHS}
        given = {name: length for name, length in lengths.items() if length is not None}
        if len(given) > 1:
            raise NacreError(f"{' and '.join(given)}: give only one of them")
        settings = replace(settings, recipe=request.recipe, device=request.device, **given)
        training, unseen = separate(collect(request.files), request.unseen)
        study = Study(
            training,
            unseen,
            settings,
            request.cache,
            others=collect(request.other),
            again=collect([request.again]) if request.again else (),
            texels=_QUICK_TEXELS if request.quick else None,
            size=request.size or SIZE,
            height_fields=request.height_fields,
            progress=request.progress,
        )
        return self.outcome(name, study, methods)

    def outcome(self, name: str, study: Study, methods: Sequence[Method]) -> Outcome:
        """The table and pages of a study.

        Raises
        ------
        NacreError
            If a codec cannot be made, a file cannot be read, or no method suits the textures.
        """
        outcome = self.make(study, methods)
        if not outcome.rows:
            reasons = sorted({reason for _, reason in study.skipped})
            raise NacreError(f"nothing could be compared: {'; '.join(reasons)}")
        kinds = dict.fromkeys(method.kind for method in methods)
        names = [", ".join(m.name for m in some) for some in (study.unseen, study.others)]
        looked = "all texels" if study.texels is None else f"{study.texels} texels per material"
        facts = {
            "Methods, with the number of values in a code": "; ".join(
                f"{kind}: {KINDS[kind].about}" for kind in kinds
            ),
            "Settings": f"{study.settings.describe()}, seed {study.settings.seed}, errors over "
            f"{looked}",
            "Materials": f"{len(study.training)} in training; unseen: {names[0]}"
            + (f"; others: {names[1]}" if study.others else ""),
        }
        left_out = study.left_out()
        trained = study.trainings(methods)
        tables = [outcome.text, *([training_table(trained)] if trained else [])]
        ending = self.describe(facts, left_out)
        text = "\n".join([f"# {name}: {self.title}\n", *tables, ending])
        return replace(outcome, text=text, left_out=left_out)


BTF_TABLE1 = TextureExperiment(
    title="errors on unseen materials by size of codes",
    methods=(
        *("custom-8", "custom-all-32"),
        *("unified-8", "unified-16", "unified-32", "unified-64", "unified-128"),
        *("pca-8", "pca-32", "pca-own-8", "pca-own-32", "basis-32"),
    ),
    make=table1,
    heeds=_OPTIONS | {"again"},
    differs=f"{_ALWAYS}; {_CUSTOM}; errors are those of reflectance factors",
)
BTF_ABLATIONS = TextureExperiment(
    title="pooling, loss and sizes of the network of 2020",
    methods=("unified-32", "unified-max-32", "unified-l2-32"),
    make=table1,
    heeds=_OPTIONS | {"again"},
    differs=f"{_ALWAYS}; the paper names the choices (section 3) without figures",
)
BTF_TRAINING = TextureExperiment(
    title="losses on held-out texels during the training of networks",
    methods=("unified-8", "unified-32"),
    make=training,
    differs=f"{_ALWAYS}; the paper shows no curve",
)
BTF_DECODER = TextureExperiment(
    title="errors and time by width and depth of the decoder",
    methods=(
        *("unified-32:2x64", "unified-32:2x106", "unified-32:4x64", "unified-32:4x106"),
        *("unified-32:4x160", "unified-32:6x106"),
    ),
    make=decoder,
    differs=f"{_ALWAYS}; the paper uses four hidden layers of 106 and shows no others",
)
BTF_FIG4 = TextureExperiment(
    title="unseen textures, measured and decoded",
    methods=("custom-all-32", "custom-32", "custom-8", "unified-32", "basis-32"),
    make=fig4,
    differs=f"{_ALWAYS}; {_CUSTOM}; the overfitted network also with codes of Table 1's size; the "
    "measured pair nearest to the paper's angles",
)
BTF_FIG5 = TextureExperiment(
    title="cylinders of unseen textures, measured and decoded",
    methods=("custom-8", "unified-8", "unified-32", "basis-32"),
    make=fig5,
    heeds=_RENDERED | {"height_fields"},
    differs=f"{_ALWAYS}; {_CUSTOM}; one cylinder under our environment, with {SIZE} pixels per "
    "edge instead of 800 unless --size is given; parallax if --height-fields is given",
)
BTF_FIG6 = TextureExperiment(
    title="textures with other directions and appearance, under a point light",
    methods=("custom-8", "unified-32", "basis-32"),
    make=fig6,
    heeds=_RENDERED | {"other"},
    differs=f"{_ALWAYS}; {_CUSTOM}; we chose the position of the light",
)
BTF_FIG7 = TextureExperiment(
    title="errors by the fraction of pairs seen",
    methods=("unified-32", "pca-32", "basis-32"),
    make=fig7,
    differs=f"{_ALWAYS}; {TEXELS} random texels of each unseen material; views below 50 degrees "
    "and entirely held-out directions are our additions",
)
BTF_FIG8 = TextureExperiment(
    title="unseen textures, decoded from a fraction of their pairs",
    methods=("unified-32", "basis-32"),
    make=fig8,
    differs=f"{_ALWAYS}; the measured pair nearest to the paper's angles",
)
BTF_FIG9 = TextureExperiment(
    title="unseen textures from three distances, filtered as images and as codes",
    methods=("unified-32", "basis-32"),
    make=fig9,
    differs=f"{_ALWAYS}; averages over 2, 4 and 8 texels per edge; the measured pair nearest to "
    "the paper's angles",
)
BTF_FIG10 = TextureExperiment(
    title="unseen textures enlarged by quilting their codes",
    methods=("unified-32", "basis-32"),
    make=fig10,
    heeds=_RENDERED,
    differs=f"{_ALWAYS}; quilting also avoids patches that merely continue their neighbors; a "
    "plane under our environment",
)
BTF_TSNE = TextureExperiment(
    title="codes of texels in a plane",
    methods=("unified-32", "basis-32"),
    make=tsne,
    differs=f"{_ALWAYS}; texels of unseen materials are ringed",
)
BTF_VIDEO = TextureExperiment(
    title="unseen textures under a moving light, measured and decoded",
    methods=("unified-32", "basis-32"),
    make=video,
    differs=f"{_ALWAYS}; the paper states neither the path of the light nor the view",
)
