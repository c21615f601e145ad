"""Detection of changes in the files of a texture, without reading them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.formats import identify, load_btf
from nacre.io.files import PathLike
from nacre.measured.textures.photographs import LIST


def source_files(path: PathLike, texture: Btf | None = None) -> list[Path]:
    """All files of a texture: a single file, or images and the list of their directions.

    `texture` is the result of :func:`nacre.load` for the path, if there is one already, so that
    headers of images are read only once.

    Raises
    ------
    FormatError
        As :func:`nacre.load`, but only the first bytes of a single file are read.
    """
    path = Path(path)
    if texture is None and identify(path).claims_folder:
        texture = load_btf(path)
    if texture is None or not texture.files:
        return [path]
    listed = path / LIST if path.is_dir() else path
    return [*([listed] if listed.is_file() else []), *texture.files]


def source_fingerprint(path: PathLike, files: Sequence[Path] | None = None) -> str:
    """SHA-256, in hexadecimal, of the names, sizes and times of change of a texture's files.

    It survives moving a folder, but not renaming it or copying it without times. `files` is the
    result of :func:`source_files` for the path, if there is one already.

    Raises
    ------
    FormatError
        As :func:`source_files`, or if a file is missing.
    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    total = hashlib.sha256(path.resolve().name.encode(errors="surrogateescape"))
    for file in source_files(path) if files is None else files:
        try:
            facts = file.stat()
        except OSError as error:
            raise FormatError(f"{file}: cannot be read: {error.strerror}") from error
        name = file.relative_to(folder).as_posix()
        total.update(
            f"\0{name}\0{facts.st_size}\0{facts.st_mtime_ns}".encode(errors="surrogateescape")
        )
    return total.hexdigest()
