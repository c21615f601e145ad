"""Where a material came from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from nacre.io.files import PathLike, digest, identity


class Source(Mapping[str, str]):
    """Name and SHA-256 of a file that was read: the keys "file" and "sha256".

    The file is hashed when the hash is first asked for, since that takes as long as to read it. If
    it has changed or gone by then there is no such key, for its hash would be that of other data.
    A folder has none either.

    Parameters
    ----------
    path
        File or folder, which is about to be read.
    """

    def __init__(self, path: PathLike) -> None:
        self._path = Path(path).absolute()
        self._name = Path(path).name
        self._state = identity(self._path)
        self._sha256: str | None = None

    def __getitem__(self, key: str) -> str:
        if key == "file":
            return self._name
        if key == "sha256" and self._hashed() and self._sha256:
            return self._sha256
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        yield "file"
        if self._hashed():
            yield "sha256"

    def __len__(self) -> int:
        return 2 if self._hashed() else 1

    def __repr__(self) -> str:
        return f"Source({self._name!r})"

    def _hashed(self) -> bool:
        """Whether the hash is known, once it was tried."""
        if self._sha256 is None and self._state is not None and self._state == identity(self._path):
            with suppress(ValueError):  # it has gone, or may not be read again
                found = digest(self._path)
                if self._state == identity(self._path):
                    self._sha256 = found
        return self._sha256 is not None
