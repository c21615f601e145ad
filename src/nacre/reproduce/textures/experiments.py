"""Every table and figure by name: what it shows, of which methods, and where it differs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from nacre.errors import NacreError
from nacre.reproduce.textures.angles import TEXELS, fig7
from nacre.reproduce.textures.map import tsne
from nacre.reproduce.textures.methods import KINDS, Method
from nacre.reproduce.textures.outcome import Outcome
from nacre.reproduce.textures.study import Study
from nacre.reproduce.textures.table import table1
from nacre.reproduce.textures.texture_figures import fig4, fig5, fig6, fig8

_ALWAYS = "the textures given; networks are trained by minutes, not epochs"
_CUSTOM = "the encoder of 2019 has layers of our choice"


@dataclass(frozen=True)
class Experiment:
    """A table or figure.

    Parameters
    ----------
    title
        What it shows.
    methods
        Names of those that are compared unless others are asked for.
    make
        What comes of it.
    differs
        From the paper, in what.
    """

    title: str
    methods: tuple[str, ...]
    make: Callable[[Study, Sequence[Method]], Outcome]
    differs: str

    def run(self, name: str, study: Study, methods: Sequence[Method], folder: Path) -> list[Path]:
        """Make what is missing, and write CSV, Markdown and pictures; gives their paths.

        Parameters
        ----------
        name
            Of the experiment.
        study
            Textures, efforts and what was kept.
        methods
            What is compared.
        folder
            Which exists.

        Raises
        ------
        NacreError
            If a codec cannot be made, a file not be read or written, or no method is for the
            textures.
        """
        outcome = self.make(study, methods)
        if not outcome.rows:
            reasons = sorted({reason for _, reason in study.skipped})
            raise NacreError(f"nothing could be compared: {'; '.join(reasons)}")
        return outcome.write(name, self._text(name, study, methods), folder)

    def _text(self, name: str, study: Study, methods: Sequence[Method]) -> str:
        kinds = dict.fromkeys(method.kind for method in methods)
        about = "; ".join(f"{kind}: {KINDS[kind].about}" for kind in kinds)
        settings = study.settings
        unseen = ", ".join(material.name for material in study.unseen)
        looked = "all texels" if study.texels is None else f"{study.texels} texels a material"
        lines = [
            f"# {name}: {self.title}",
            "{table}",
            f"**Methods**, with the values of a code: {about}.",
            f"**Settings:** {settings.minutes:g} minutes a network, seed {settings.seed}, errors "
            f"over {looked}.",
            f"**Materials:** {len(study.training)} of the training; unseen: {unseen}"
            + (f"; others: {', '.join(m.name for m in study.others)}" if study.others else "")
            + ".",
            f"**Differs from the paper:** {self.differs}.",
        ]
        for method, reason, where in study.left_out():
            lines.append(f"**Left out:** {method} ({', '.join(where)}): {reason}.")
        return "\n\n".join(lines) + "\n"


EXPERIMENTS: Mapping[str, Experiment] = {
    "btf-table1": Experiment(
        "errors of unseen materials by size of codes",
        (
            *("custom-8", "custom-all-32"),
            *("unified-8", "unified-16", "unified-32", "unified-64", "unified-128"),
            *("pca-8", "pca-32", "pca-own-8", "pca-own-32", "basis-32"),
        ),
        table1,
        f"{_ALWAYS}; {_CUSTOM}; errors are of reflectance factors",
    ),
    "btf-fig4": Experiment(
        "unseen textures, measured and decoded",
        ("custom-all-32", "custom-8", "unified-32", "basis-32"),
        fig4,
        f"{_ALWAYS}; {_CUSTOM}; codes of the overfitted network are those of Table 1, not as large "
        "as the others'; the measured pair nearest to the paper's angles",
    ),
    "btf-fig5": Experiment(
        "cylinders of unseen textures, measured and decoded",
        ("custom-8", "unified-8", "unified-32", "basis-32"),
        fig5,
        f"{_ALWAYS}; {_CUSTOM}; one cylinder under our environment, without height fields",
    ),
    "btf-fig6": Experiment(
        "textures of other directions and other looks",
        ("custom-8", "unified-32", "basis-32"),
        fig6,
        f"{_ALWAYS}; {_CUSTOM}; textures at a light and a view in place of renderings",
    ),
    "btf-fig7": Experiment(
        "errors by the share of pairs that are seen",
        ("unified-32", "pca-32", "basis-32"),
        fig7,
        f"{_ALWAYS}; {TEXELS} random texels of each unseen material; views below 50 degrees, and "
        "directions held out whole, are ours",
    ),
    "btf-fig8": Experiment(
        "unseen textures, decoded from a share of their pairs",
        ("unified-32", "basis-32"),
        fig8,
        f"{_ALWAYS}; the measured pair nearest to the paper's angles",
    ),
    "btf-tsne": Experiment(
        "codes of texels in the plane",
        ("unified-32", "basis-32"),
        tsne,
        f"{_ALWAYS}; texels of unseen materials are ringed",
    ),
}
"""Every experiment by name."""
