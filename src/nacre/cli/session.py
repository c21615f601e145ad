"""The state of one run of the command line: shared options, streams, temporary folders."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.io.names import guessed_ending

if TYPE_CHECKING:
    from nacre.cli.display import Display


@dataclass
class Session:
    """One run of the command line; the flags are the options of these names."""

    quiet: bool = False
    verbose: bool = False
    force: bool = False
    as_json: bool = False
    dry_run: bool = False
    display: Display | None = None
    piped: Path | None = None
    """File to copy to standard output at the end."""
    folders: list[Path] = field(default_factory=list)
    """Temporary folders for standard input and output."""
    reading: dict[str, Any] = field(default_factory=dict)
    """What readers are told; see :mod:`nacre.cli.reading`."""
    stack: ExitStack = field(default_factory=ExitStack)

    def folder(self) -> Path:
        """A temporary folder, removed when the command ends."""
        import shutil
        import tempfile

        folder = Path(tempfile.mkdtemp(prefix="nacre-"))
        self.folders.append(folder)
        self.stack.callback(shutil.rmtree, folder, ignore_errors=True)
        return folder

    def spooled(self) -> Path:
        """Standard input as a file, with an ending if its first bytes suggest one."""
        import shutil

        first = sys.stdin.buffer.read(64)
        ending = guessed_ending(first)
        path = self.folder() / f"stdin{ending}"
        with path.open("wb") as file:
            file.write(first)
            shutil.copyfileobj(sys.stdin.buffer, file)
        return path

    def to_stdout(self, ending: str) -> Path:
        """A file whose content goes to standard output at the end."""
        self.piped = self.folder() / f"stdout{ending}"
        return self.piped

    def flush(self) -> None:
        """Copy the file for standard output there."""
        if self.piped is not None and self.piped.exists():
            sys.stdout.flush()
            sys.stdout.buffer.write(self.piped.read_bytes())
            sys.stdout.buffer.flush()


_current = Session()


def session() -> Session:
    return _current


def begin() -> Session:
    global _current
    _current = Session()
    return _current
