"""What every table and figure has in common: what it is asked for, what comes of it, its files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nacre.errors import NacreError, require
from nacre.figures.page import Bytes
from nacre.figures.plot import write_plot
from nacre.latent import find_basis
from nacre.latent.basis import LatentBasis
from nacre.render.animation import write_animation
from nacre.runtime.progress import Progress, silent
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.tables import write_csv, write_text
from nacre_lab.reproduce.trial import TRUTH

LeftOut = tuple[str, str, Sequence[str]]
"""A method, why it was not tried, and on which materials."""


@dataclass(frozen=True)
class Request:
    """What a user asks of an experiment.

    Parameters
    ----------
    files
        Materials, or textures and folders of some.
    methods
        Names of what is compared; the experiment's own choice where empty.
    folder
        For what is kept; made if it is not there.
    published
        Folders of networks that others fitted, and of tables of fits.
    basis
        A file of :mod:`nacre.latent`; the pretrained one where None.
    environment
        Latitude-longitude map; the built-in studio where None.
    size
        Pixels along an edge of the pictures; the experiment's own choice where None.
    recipe
        Of networks for textures, by name.
    steps, epochs, minutes
        Length of each training: epochs of any network, steps and minutes of those for textures,
        steps of bases too; the experiment's own choice where None.
    device
        PyTorch device that networks for textures are trained on.
    unseen
        Names of textures or materials that are kept from training.
    other
        Files or folders of further unseen textures, of any directions.
    height_fields
        Folder of heights that the texels of unseen textures are points of, NAME.exr each.
    again
        Folder of second measurements of unseen textures.
    quick
        Whether pictures are small and trainings short: figures to look at.
    seed
        Of everything random.
    fresh
        Whether what is kept is made again.
    jobs
        Materials at a time; one a core where None.
    progress
        Called as the work goes on.
    """

    files: Sequence[Path]
    folder: Path
    methods: Sequence[str] = ()
    published: Sequence[Path] = ()
    basis: Path | None = None
    environment: Path | None = None
    size: int | None = None
    recipe: str = "default"
    steps: int | None = None
    epochs: int | None = None
    device: str = "cpu"
    minutes: float | None = None
    unseen: Sequence[str] = ()
    other: Sequence[Path] = ()
    height_fields: Path | None = None
    again: Path | None = None
    quick: bool = False
    seed: int = 0
    fresh: bool = False
    jobs: int | None = None
    progress: Progress = silent

    @property
    def cache(self) -> Cache:
        """Where results are kept."""
        return Cache(self.folder, fresh=self.fresh)

    def find_basis(self) -> LatentBasis:
        """The basis that codes are of: that in the file given, or the pretrained one."""
        basis: LatentBasis = find_basis(str(self.basis or "neural"))
        return basis

    def known_methods(self, known: Iterable[str]) -> list[str]:
        """The methods asked for.

        Raises
        ------
        NacreError
            If there is none of a name.
        """
        names = [name for name in known if name != TRUTH]
        for name in self.methods:
            if name not in names:
                raise NacreError(f"{name!r} is no method here; --list prints them")
        return list(self.methods)


@dataclass(frozen=True)
class Outcome:
    """Numbers, text and pages.

    Parameters
    ----------
    pages
        Matplotlib figures by what is added to the experiment's name.
    columns, rows
        Of the CSV file; there is none without columns.
    text
        Markdown; there is no file where it is empty.
    note
        A few words on the pictures.
    left_out
        What was not tried.
    animations
        Frames, two or more, by what is added to the experiment's name.
    """

    pages: Mapping[str, Any]
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[object]] = ()
    text: str = ""
    note: str = ""
    left_out: Sequence[LeftOut] = field(default=())
    animations: Mapping[str, Sequence[Bytes]] = field(default_factory=dict)

    def write(self, name: str, folder: Path) -> list[Path]:
        """Write CSV, Markdown, pictures and animations, `name` in front of each; gives their paths.

        Raises
        ------
        FormatError
            If a file cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        written = []
        if self.columns:
            written.append(folder / f"{name}.csv")
            write_csv(self.columns, self.rows, written[-1])
        if self.text:
            written.append(folder / f"{name}.md")
            write_text(self.text, written[-1])
        for addition, page in self.pages.items():
            written.append(folder / f"{'-'.join(filter(None, (name, addition)))}.png")
            write_plot(page, written[-1])
        for addition, frames in self.animations.items():
            written.append(folder / f"{name}-{addition}.webp")
            write_animation(frames, written[-1])
        return written


@dataclass(frozen=True, kw_only=True)
class Experiment(ABC):
    """A table or figure of a paper.

    Parameters
    ----------
    title
        What it shows.
    differs
        How the protocol differs from the paper's.
    heeds
        Names of the fields of :class:`Request` that it heeds, besides its files.
    """

    title: str
    differs: str
    heeds: frozenset[str]

    @abstractmethod
    def run(self, name: str, request: Request) -> Outcome:
        """Make what is not kept yet, and draw it.

        Parameters
        ----------
        name
            Of the experiment.
        request
            What is asked for.

        Raises
        ------
        NacreError
            If a file cannot be read, or nothing could be compared.
        MissingExtraError
            If an optional library is not installed.
        """

    def describe(self, facts: Mapping[str, str], left_out: Sequence[LeftOut]) -> str:
        """The end of a Markdown page: facts by their titles, and how all differs from the paper."""
        lines = [f"**{title}:** {text}." for title, text in facts.items()]
        lines.append(f"**Differs from the paper:** {self.differs}.")
        if left_out:
            items = [f"- {m}: {why} ({', '.join(where)})" for m, why, where in left_out]
            lines.append("\n".join(["**Left out:**\n", *items]))
        return "\n\n".join(lines) + "\n"


def reproduce(
    experiment: Experiment, name: str, request: Request, output: Path
) -> tuple[list[Path], Outcome]:
    """Run an experiment and write its files.

    Raises
    ------
    NacreError
        See :meth:`Experiment.run`.
    """
    require("matplotlib.figure", "plot")
    outcome = experiment.run(name, request)
    return outcome.write(name, output), outcome
