"""The base of every table and figure: its request, outcome and files."""

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
from nacre.mitsuba.animation import write_animation
from nacre.runtime.progress import Progress, silent
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.tables import write_csv, write_text
from nacre_lab.reproduce.trial import TRUTH

LeftOut = tuple[str, str, Sequence[str]]
"""A method, why it was left out, and for which materials."""


@dataclass(frozen=True)
class Request:
    """A user's request to an experiment.

    Parameters
    ----------
    files
        Materials, or textures and folders of some.
    methods
        Names of the methods to compare; the experiment's own choice if empty.
    folder
        Cache of results, made if necessary.
    published
        Folders with published networks or tables of fits.
    basis
        A file of :mod:`nacre.latent`; the pretrained one if None.
    environment
        Latitude-longitude map; the built-in studio if None.
    size
        Pixels along an edge of the pictures; the experiment's own choice if None.
    recipe
        Name of the recipe of networks for textures.
    steps, epochs, minutes
        Length of each training: epochs for any network, steps and minutes for those for textures,
        steps also for bases; the experiment's own choice if None.
    device
        PyTorch device to train networks for textures on.
    unseen
        Names of textures or materials to exclude from training.
    other
        Files or folders of more unseen textures, with any directions.
    height_fields
        Folder of height fields (NAME.exr) for unseen textures whose texels follow a surface.
    again
        Folder of second measurements of unseen textures.
    quick
        Make small pictures and short trainings, for a first look.
    seed
        Seed of everything random.
    fresh
        Ignore and replace cached results.
    jobs
        Number of materials at the same time; one per core if None.
    progress
        Called with the progress.
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
        """The cache of results."""
        return Cache(self.folder, fresh=self.fresh)

    def find_basis(self) -> LatentBasis:
        """The basis of codes: that in the given file, or the pretrained one."""
        basis: LatentBasis = find_basis(str(self.basis or "neural"))
        return basis

    def known_methods(self, known: Iterable[str]) -> list[str]:
        """The requested methods.

        Raises
        ------
        NacreError
            If a name is unknown.
        """
        names = [name for name in known if name != TRUTH]
        for name in self.methods:
            if name not in names:
                raise NacreError(f"{name!r} is not a method here; --list prints them")
        return list(self.methods)


@dataclass(frozen=True)
class Outcome:
    """Numbers, text and pages.

    Parameters
    ----------
    pages
        Matplotlib figures by what is added to the experiment's name.
    columns, rows
        Table for the CSV file; without columns, there is none.
    text
        Markdown; if empty, there is no file.
    note
        A few words about the pictures.
    left_out
        Methods that were left out.
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
        """Write CSV, Markdown, pictures and animations with the prefix `name`; returns their paths.

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
        How the protocol differs from that of the paper.
    heeds
        Fields of :class:`Request` that it uses, besides the files.
    """

    title: str
    differs: str
    heeds: frozenset[str]

    @abstractmethod
    def run(self, name: str, request: Request) -> Outcome:
        """Compute what is not cached, and draw it.

        Parameters
        ----------
        name
            Of the experiment.
        request
            The request.

        Raises
        ------
        NacreError
            If a file cannot be read, or nothing could be compared.
        MissingExtraError
            If an optional library is not installed.
        """

    def describe(self, facts: Mapping[str, str], left_out: Sequence[LeftOut]) -> str:
        """The end of a Markdown page: facts by title, and the differences from the paper."""
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
