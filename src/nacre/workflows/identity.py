"""Whether the files of a texture are those of an earlier time, without reading them."""

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
    """All files of a texture: one; or of images, the list of their directions and all of them.

    Parameters
    ----------
    path
        As :func:`nacre.load` takes it.
    texture
        What that gave, where it was called before: headers of images are read once.

    Raises
    ------
    FormatError
        As :func:`nacre.load`, though of a single file no more than its first bytes is
        read.
    """
    path = Path(path)
    if texture is None and identify(path).claims_folder:
        texture = load_btf(path)
    if texture is None or not texture.files:
        return [path]
    listed = path / LIST if path.is_dir() else path
    return [*([listed] if listed.is_file() else []), *texture.files]


def source_fingerprint(path: PathLike, files: Sequence[Path] | None = None) -> str:
    """SHA-256, in hexadecimal, of names, sizes and times of change of all files of a texture.

    A folder keeps it when it is moved, not when it is renamed or copied without its times.

    Parameters
    ----------
    path
        As :func:`source_files` takes it.
    files
        What that gave, if it was called before.

    Raises
    ------
    FormatError
        As :func:`source_files`, or if a file is not there.
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
