"""Measured files in folders, and what their fits are called."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from nacre.errors import FormatError
from nacre.formats import has_measured_ending, is_measured
from nacre.io.files import PathLike


@dataclass(frozen=True)
class Source:
    """A file to fit, or to show.

    Parameters
    ----------
    path
        Where it is.
    relative
        Where it is below the folder that was given; the bare name of a file that was given itself.
    """

    path: Path
    relative: PurePosixPath


def find_sources(
    paths: Sequence[PathLike],
    output: PathLike,
    left_out: Callable[[Path], None] = lambda path: None,
) -> list[Source]:
    """The files among `paths`, and in the folders among them all that are measured materials.

    Folders are searched to any depth, but links to folders are not followed. What is hidden (its
    name starts with a dot) is left out, and so is the folder `output` where it lies within one that
    is searched. A file that is met twice counts once.

    Parameters
    ----------
    paths
        Files, taken whatever they hold, and folders, in which :func:`nacre.formats.is_measured`
        decides.
    output
        Folder of the fits.
    left_out
        Called with every file in a folder that has an ending of measurements, but is none: another
        kind of file, or one that is cut short.

    Returns
    -------
    list of Source
        In the order of the paths, and by name within a folder.

    Raises
    ------
    FormatError
        If a path does not exist, or a folder cannot be listed.
    """
    return gather(paths, lambda root: _measured(root, Path(output).resolve(), left_out))


def gather(paths: Iterable[PathLike], below: Callable[[Path], Iterable[Source]]) -> list[Source]:
    """The files among `paths`, and what `below` finds in the folders among them, each once.

    Raises
    ------
    FormatError
        If a path does not exist.
    """
    found: dict[Path, Source] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise FormatError(f"{path}: does not exist")
        listed = below(path) if path.is_dir() else [Source(path, PurePosixPath(path.name))]
        for source in listed:
            found.setdefault(source.path.resolve(), source)
    return list(found.values())


def files_below(root: Path, without: Path | None = None) -> Iterator[Source]:
    """The files in a folder and below it, by name, but not what is hidden or lies in `without`.

    Links to folders are not followed.

    Raises
    ------
    FormatError
        If a folder cannot be listed.
    """

    def refuse(error: OSError) -> None:
        raise FormatError(f"{error.filename}: cannot be listed: {error.strerror}") from error

    for name, folders, files in os.walk(root, onerror=refuse):
        folder = Path(name)
        folders[:] = sorted(
            f for f in folders if not f.startswith(".") and (folder / f).resolve() != without
        )
        for path in (folder / file for file in sorted(files) if not file.startswith(".")):
            if path.is_file():
                yield Source(path, PurePosixPath(path.relative_to(root).as_posix()))


def _measured(root: Path, output: Path, left_out: Callable[[Path], None]) -> Iterator[Source]:
    """Measured files in a folder, but not those in the folder `output` within it."""
    for source in files_below(root, output):
        if not has_measured_ending(source.path):
            continue
        if is_measured(source.path):
            yield source
        else:
            left_out(source.path)


def output_names(sources: Sequence[Source], ending: str) -> list[str]:
    """The file that each source's fit is written to, relative to the folder of the fits.

    It is the source's relative path with another ending, `metals/gold.safetensors` of
    `metals/gold.binary`. Where two sources would share one, both keep their own ending as well:
    `gold.binary.safetensors` and `gold.bsdf.safetensors`. Letters that differ in case only count as
    the same, as some file systems have it.

    Parameters
    ----------
    sources
        Of one run.
    ending
        Of the files to write, with the dot.

    Raises
    ------
    FormatError
        If two sources share their whole relative path.
    """
    short = [str(source.relative.with_suffix(ending)) for source in sources]
    shared = Counter(name.casefold() for name in short)
    names: dict[str, Source] = {}
    result = []
    for source, name in zip(sources, short, strict=True):
        if shared[name.casefold()] > 1:
            name = f"{source.relative}{ending}"
        first = names.setdefault(name.casefold(), source)
        if first is not source:
            raise FormatError(
                f"{source.path}: would be written to the same name as {first.path}; "
                "give the folder that holds both, or fit them into two folders"
            )
        result.append(name)
    return result
