"""What tells whether the files of a texture are those of an earlier time, without reading them."""

from __future__ import annotations

import hashlib
from pathlib import Path

from nacre.btf.formats import load, recognised
from nacre.btf.image_folder import ImageFolderBtf
from nacre.btf.photographs import LIST
from nacre.files import FormatError, PathLike


def source_mark(path: PathLike) -> str:
    """SHA-256, in hexadecimal, of names, sizes and times of change of all files of a texture.

    These are the file; or of a folder of images, or a list of photographs, the list and all images,
    but nothing else that lies there. A folder keeps its mark when it is moved, not when it is
    renamed or copied without its times.

    Parameters
    ----------
    path
        As :func:`nacre.btf.load` takes it.

    Raises
    ------
    FormatError
        As :func:`nacre.btf.load`, though of a single file no more than its first bytes is read.
    """
    path = Path(path)
    files, folder = [path], path.parent
    if recognised(path).recognise is None:  # images, which no first bytes tell
        texture = load(path)
        assert isinstance(texture, ImageFolderBtf)
        if path.is_dir():
            files, folder = [path / LIST] if (path / LIST).is_file() else [], path
        files += texture.files
    total = hashlib.sha256(path.resolve().name.encode(errors="surrogateescape"))
    for file in files:
        try:
            facts = file.stat()
        except OSError as error:
            raise FormatError(f"{file}: cannot be read: {error.strerror}") from error
        name = file.relative_to(folder).as_posix()
        total.update(
            f"\0{name}\0{facts.st_size}\0{facts.st_mtime_ns}".encode(errors="surrogateescape")
        )
    return total.hexdigest()
