"""Every table and figure by name: what it shows, of which methods, and where it differs."""

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

_ALWAYS = "the textures given; networks are trained as the table says, for 1000 epochs there"
_QUICK_TEXELS = 48
"""Of each texture at which errors are found, if it should be quick."""
_LENGTHS = ("steps", "epochs", "minutes")
_OPTIONS = frozenset(
    ("methods", "unseen", "recipe", *_LENGTHS, "device", "quick", "seed", "folder", "fresh")
)
_RENDERED = _OPTIONS | {"size"}
_CUSTOM = "the encoder of 2019 has layers of our choice"


@dataclass(frozen=True, kw_only=True)
class TextureExperiment(Experiment):
    """A table or figure of textures.

    Parameters
    ----------
    methods
        Names of those that are compared unless others are asked for.
    make
        Its table in Markdown, rows and pages.
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
            raise NacreError(f"{' and '.join(given)}: give one of them")
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
            If a codec cannot be made, a file not be read, or no method is for the textures.
        """
        outcome = self.make(study, methods)
        if not outcome.rows:
            reasons = sorted({reason for _, reason in study.skipped})
            raise NacreError(f"nothing could be compared: {'; '.join(reasons)}")
        kinds = dict.fromkeys(method.kind for method in methods)
        names = [", ".join(m.name for m in some) for some in (study.unseen, study.others)]
        looked = "all texels" if study.texels is None else f"{study.texels} texels a material"
        facts = {
            "Methods, with the number of values in a code": "; ".join(
                f"{kind}: {KINDS[kind].about}" for kind in kinds
            ),
            "Settings": f"{study.settings.describe()}, seed {study.settings.seed}, errors over "
            f"{looked}",
            "Materials": f"{len(study.training)} of the training; unseen: {names[0]}"
            + (f"; others: {names[1]}" if study.others else ""),
        }
        left_out = study.left_out()
        trained = study.trainings(methods)
        tables = [outcome.text, *([training_table(trained)] if trained else [])]
        ending = self.describe(facts, left_out)
        text = "\n".join([f"# {name}: {self.title}\n", *tables, ending])
        return replace(outcome, text=text, left_out=left_out)


BTF_TABLE1 = TextureExperiment(
    title="errors of unseen materials by size of codes",
    methods=(
        *("custom-8", "custom-all-32"),
        *("unified-8", "unified-16", "unified-32", "unified-64", "unified-128"),
        *("pca-8", "pca-32", "pca-own-8", "pca-own-32", "basis-32"),
    ),
    make=table1,
    heeds=_OPTIONS | {"again"},
    differs=f"{_ALWAYS}; {_CUSTOM}; errors are of reflectance factors",
)
BTF_ABLATIONS = TextureExperiment(
    title="pooling, loss and sizes of the network of 2020",
    methods=("unified-32", "unified-max-32", "unified-l2-32"),
    make=table1,
    heeds=_OPTIONS | {"again"},
    differs=f"{_ALWAYS}; the paper names the choices (section 3) without figures",
)
BTF_TRAINING = TextureExperiment(
    title="losses on held-out texels while networks are trained",
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
    differs=f"{_ALWAYS}; the paper takes four hidden layers of 106 and shows no others",
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
    differs=f"{_ALWAYS}; {_CUSTOM}; one cylinder under our environment, of {SIZE} pixels an edge "
    "for 800 unless --size is given; parallax where --height-fields is given",
)
BTF_FIG6 = TextureExperiment(
    title="textures of other directions and other appearance, lit by a point",
    methods=("custom-8", "unified-32", "basis-32"),
    make=fig6,
    heeds=_RENDERED | {"other"},
    differs=f"{_ALWAYS}; {_CUSTOM}; cylinders under a light of our place",
)
BTF_FIG7 = TextureExperiment(
    title="errors by the fraction of pairs that are seen",
    methods=("unified-32", "pca-32", "basis-32"),
    make=fig7,
    differs=f"{_ALWAYS}; {TEXELS} random texels of each unseen material; views below 50 degrees, "
    "and directions held out whole, are ours",
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
    differs=f"{_ALWAYS}; means of 2, 4 and 8 texels an edge; the measured pair nearest to the "
    "paper's angles",
)
BTF_FIG10 = TextureExperiment(
    title="unseen textures made larger by quilting of codes",
    methods=("unified-32", "basis-32"),
    make=fig10,
    heeds=_RENDERED,
    differs=f"{_ALWAYS}; quilting also keeps patches apart that would only continue; a plane under "
    "our environment",
)
BTF_TSNE = TextureExperiment(
    title="codes of texels in the plane",
    methods=("unified-32", "basis-32"),
    make=tsne,
    differs=f"{_ALWAYS}; texels of unseen materials are ringed",
)
BTF_VIDEO = TextureExperiment(
    title="unseen textures under a moving light, measured and decoded",
    methods=("unified-32", "basis-32"),
    make=video,
    differs=f"{_ALWAYS}; the paper states neither the way of the light nor the view",
)
