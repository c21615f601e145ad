"""Where a material came from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from nacre.io.files import PathLike, digest, identity, read_bytes

TERMS = "-TERMS.txt"
"""End of the names of files that hold the terms of use for all files beside them."""

_MAX_TERMS = 1 << 14  # bytes


class Source(Mapping[str, str]):
    """Where a file is from: its name, its SHA-256, its terms of use: "file", "sha256" and "terms".

    The file is hashed when the hash is first asked for, since that takes as long as reading it. If
    it has changed or gone by then there is no such key, for its hash would be that of other data. A
    folder has none either. Terms are those that `nacre download` left in the folder, if any. Make
    one before the file is read.
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
        if key == "terms" and (terms := self._terms()):
            return terms
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        yield "file"
        if self._hashed():
            yield "sha256"
        if self._terms():
            yield "terms"

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Source):
            whence = self._path, self._state
            if self._state is not None and whence == (other._path, other._state):
                return True
        return super().__eq__(other)

    __hash__ = None  # type: ignore[assignment]

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

    def _terms(self) -> str:
        """Terms of use that lie beside the file, on one line; empty if there are none."""
        for path in sorted(self._path.parent.glob(f"*{TERMS}")):
            with suppress(ValueError):
                text = read_bytes(path, _MAX_TERMS).decode("utf-8", "replace")
                return " ".join(text.split())
        return ""
