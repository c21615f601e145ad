"""Measured files in folders, and the names of their fits."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from nacre.errors import FormatError
from nacre.formats import has_measured_ending, is_measured, is_one_material
from nacre.io.files import PathLike, missing
from nacre.io.names import stem


@dataclass(frozen=True)
class Source:
    """A file to fit or to show."""

    path: Path
    relative: PurePosixPath  # to the given folder; the bare name if the file itself was given


def find_sources(
    paths: Sequence[PathLike],
    output: PathLike,
    left_out: Callable[[Path], None] = lambda path: None,
) -> list[Source]:
    """The files among `paths`, and all measured materials in the folders among them.

    Folders are searched to any depth, without following links to folders. Hidden files and folders
    (their names start with a dot) are left out, and so is `output`, the folder of the fits. Files
    in a folder count if :func:`nacre.formats.is_measured`, each once.

    Parameters
    ----------
    left_out
        Called with every file in a folder that has the ending of a measurement but is not one: it
        is of another kind, or incomplete.

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

    A FormatError is raised if a path does not exist.
    """
    found: dict[Path, Source] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise missing(path)
        many = path.is_dir() and not is_one_material(path)
        listed = below(path) if many else [Source(path, PurePosixPath(path.name))]
        for source in listed:
            found.setdefault(source.path.resolve(), source)
    return list(found.values())


def files_below(root: Path, without: Path | None = None) -> Iterator[Source]:
    """The files in a folder and below it, by name, except hidden ones and those in `without`.

    Links to folders are not followed. A FormatError is raised if a folder cannot be listed.
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
    for source in files_below(root, output):
        if is_measured(source.path):
            yield source
        elif has_measured_ending(source.path):
            left_out(source.path)


def output_names(sources: Sequence[Source], ending: str) -> list[str]:
    """The file for each source's fit, relative to the folder of the fits.

    It is the source's relative path with another ending: `metals/gold.safetensors` for
    `metals/gold.binary` and `metals/gold.binary.gz`. If two sources would share a name, both keep
    their own ending as well: `gold.binary.safetensors` and `gold.bsdf.safetensors`. Case does not
    distinguish names, because some file systems ignore it.

    Raises
    ------
    FormatError
        If two sources share their whole relative path.
    """
    short = [str(source.relative.with_name(f"{stem(source.path)}{ending}")) for source in sources]
    shared = Counter(name.casefold() for name in short)
    names: dict[str, Source] = {}
    result = []
    for source, name in zip(sources, short, strict=True):
        if shared[name.casefold()] > 1:
            name = f"{source.relative}{ending}"
        first = names.setdefault(name.casefold(), source)
        if first is not source:
            raise FormatError(
                f"{source.path}: its fit would have the same name as that of {first.path}; "
                "give the folder that holds both, or fit them into two folders"
            )
        result.append(name)
    return result
