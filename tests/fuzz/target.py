"""One input to one reader: what the fuzzer calls, and what a saved input is tried again with."""

from __future__ import annotations

import contextlib
import hashlib
import json
import resource
import tempfile
import time
import traceback
import tracemalloc
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from unittest import mock

from nacre.brdf import CosineSampler
from nacre.btf import Btf
from nacre.io.format import Format
from tests.fuzz.readers import Reader
from tests.reading import check_reading, check_texture, check_use
from tests.specimens import Specimen

TIME_LIMIT = 5.0
"""Seconds of processor time for one input."""

_SHARED_MEMORY = Path("/dev/shm")


@dataclass
class Figures:
    """What a run has seen so far; `peak` in bytes, `resident` in MiB, `seconds` of CPU time."""

    loaded: int = 0
    peak: int = 0
    executed: int = 0
    resident: int = 0
    seconds: float = 0.0


class Target:
    """Tries inputs on a reader, and keeps one input for each place that fails.

    Parameters
    ----------
    entry, specimen
        The format, or the reader of something else.
    output
        Folder for inputs that fail and for the figures.
    folder
        Empty folder to work in.
    """

    def __init__(
        self, entry: Format | Reader, specimen: Specimen, output: Path, folder: Path
    ) -> None:
        self.entry = entry
        self.specimen = specimen
        self._output = output
        (folder / "again").mkdir()
        (folder / "read").mkdir()
        self.path = folder / "read" / specimen.name
        self._again = folder / "again" / specimen.name
        for name, content in specimen.companions.items():
            self.path.with_name(name).write_bytes(content)
        self._seen: set[str] = set()
        self.figures = Figures()

    def warm_up(self) -> None:
        """Read whole files, so that what is imported late is not counted as memory of a file."""
        for content in self.specimen.files():
            self.path.write_bytes(content)
            if isinstance(self.entry, Reader):
                self.entry.read(self.path)
                continue
            loaded = self.entry.load(self.path)
            if isinstance(loaded, Btf):
                check_texture(loaded)

    def check(self, data: bytes) -> bool:
        """Try one input; whether it was read.

        Raises
        ------
        Exception
            Whatever a reader must not do.
        """
        self.path.write_bytes(data)
        start = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if isinstance(self.entry, Reader):
                loaded, peak = check_use(self.entry, self.path)
            else:
                loaded, peak = check_reading(self.entry, self.specimen, self.path, self._again)
        seconds = time.process_time() - start
        assert seconds < TIME_LIMIT, f"took {seconds:.1f} s"
        self.figures.loaded += loaded
        self.figures.peak = max(self.figures.peak, peak)
        return loaded

    def __call__(self, data: bytes) -> None:
        """Try one input; keep it if it fails where none has before, and go on."""
        self.figures.executed += 1
        if self.figures.executed & 127 == 1:
            self.write_figures()
        try:
            self.check(data)
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            place = "".join(f"{frame.filename}:{frame.lineno};" for frame in frames)
            if place not in self._seen:
                self._seen.add(place)
                name = f"failure-{hashlib.sha256(place.encode()).hexdigest()[:12]}"
                (self._output / name).write_bytes(data)
                report = "".join(traceback.format_exception(error))
                (self._output / f"{name}.txt").write_text(report, errors="backslashreplace")

    def write_figures(self) -> None:
        """Keep the figures where the process that started this one finds them."""
        used = resource.getrusage(resource.RUSAGE_SELF)
        self.figures.resident = used.ru_maxrss >> 10
        self.figures.seconds = used.ru_utime + used.ru_stime
        (self._output / "figures.json").write_text(json.dumps(asdict(self.figures)))


def working_folder() -> tempfile.TemporaryDirectory[str]:
    """A folder that is removed at the end, in memory where it can be."""
    return tempfile.TemporaryDirectory(dir=_SHARED_MEMORY if _SHARED_MEMORY.is_dir() else None)


@contextlib.contextmanager
def target(
    entry: Format | Reader, specimen: Specimen, output: Path, where: Path | None = None
) -> Iterator[Target]:
    """A target with a working folder, within `where` if that is given, tracing allocations.

    Lobes are not fitted to networks meanwhile: that takes longer than all the rest.
    """
    with (
        tempfile.TemporaryDirectory(dir=where) if where else working_folder() as folder,
        mock.patch("nacre.neural.published.fit_lobes", return_value=CosineSampler()),
    ):
        test = Target(entry, specimen, output, Path(folder))
        test.warm_up()
        tracemalloc.start()
        try:
            yield test
        finally:
            tracemalloc.stop()
