"""A folder in which a command runs and is disturbed, and what must hold there afterwards."""

from __future__ import annotations

import fnmatch
import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import safetensors.numpy
from safetensors import SafetensorError

from nacre.io.files import atomic_path
from nacre.io.outputs import written_by
from tests.faults.commands import ROOT, Long

TEMPORARY = re.compile(r"\.[0-9a-f]{16}(\.\w+)?")
_SHA256 = re.compile(rb"[0-9a-f]{64}")
MINE = b"a file of the user's\n"
OLD = {
    ".safetensors": safetensors.numpy.save({}, {"nacre": "{}"}),
    ".npz": b"PK\5\6" + bytes(18),
    ".png": b"\x89PNG\r\n\x1a\n\0\0\0\0IEND\xaeB`\x82",
    ".json": b'{"old": 1\n}\n',
    ".csv": b"# old\n",
    **dict.fromkeys((".html", ".svg", ".js", ".exr", ".glsl", ".h", ".xml", ".h5"), b"old\n"),
}
"""What the same command wrote before, by ending; in other formats files cannot say who did."""
PATIENCE = 600.0
"""Seconds after which a process hangs."""


@dataclass(frozen=True)
class Moment:
    """When a fault comes: after so many seconds of processor time, whatever else the machine does,
    or at the n-th change in `out`.
    """

    seconds: float = 0.0
    change: int = 0


@dataclass(frozen=True)
class Outcome:
    """What came of a run.

    Parameters
    ----------
    code
        Exit code; the negative number of a signal that ended it.
    text
        Standard error.
    met
        Whether the fault came before the end.
    """

    code: int
    text: str
    met: bool

    @property
    def shown(self) -> str:
        """For a report of a problem."""
        return f"exit code {self.code}, {self.text[-600:]!r}"


Act = Callable[["subprocess.Popen[bytes]"], None]


class Trial:
    """The folder of one command.

    Parameters
    ----------
    long
        The command.
    command
        What to run.
    folder
        Where; it is made.
    """

    def __init__(self, long: Long, command: list[str], folder: Path) -> None:
        self.long, self.command, self.folder = long, command, folder
        self.out = folder / "out"
        self.out.mkdir(parents=True)
        long.prepare(folder)
        self.reference: dict[str, bytes] = {}
        self.old: dict[str, bytes] = {}
        self.seconds, self.changes, self.peak = 0.0, 0, 0
        self._fresh()

    def measure(self) -> None:
        """Run twice: what it writes, how long it takes, in how many changes and bytes."""
        self.run()  # compiles kernels
        self._fresh()
        self.seconds, self.changes, self.peak = 0.0, 0, 0
        done = self.run()
        assert done.code == 0, done.shown
        self.keep()
        assert not self.problems(done, finished=True), self.problems(done, finished=True)

    def keep(self) -> None:
        """Take what was written as what has to be written."""
        self.reference = {
            name: self._path(name).read_bytes() for name in self._names() if self._is_output(name)
        }
        for pattern in self.long.outputs:
            assert fnmatch.filter(self.reference, pattern), f"{pattern}: nothing was written"

    def begin(self, previous: bool = False) -> None:
        """Empty `out`, put the inputs back, and perhaps what the command wrote before."""
        self._fresh()
        for name in self.long.inputs:
            self.long.write_input(self.folder, name)
        self.old = {}
        if not (previous and self.long.called):
            return
        for name in self.reference.keys() - self._journals():
            path = self._path(name)
            if path.suffix in OLD:
                path.parent.mkdir(parents=True, exist_ok=True)
                with written_by(self.long.called), atomic_path(path) as temporary:
                    temporary.write_bytes(OLD[path.suffix])
                self.old[name] = path.read_bytes()

    def _fresh(self) -> None:
        self.out.mkdir(exist_ok=True)
        for entry in self.out.iterdir():
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        (self.out / "mine.txt").write_bytes(MINE)

    def start(self, **environment: str) -> subprocess.Popen[bytes]:
        """Start the command in a group of its own."""
        path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
        return subprocess.Popen(
            self.command,
            cwd=self.folder,
            env={
                **os.environ,
                "PYTHONPATH": path,
                "OMP_NUM_THREADS": "1",
                **environment,
            },
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )

    def run(
        self, moment: Moment | None = None, act: Act | None = None, **environment: str
    ) -> Outcome:
        """Run to the end, disturbed at a moment by `act`."""
        process = self.start(**environment)
        met = self._wait(process, moment)
        if met and act:
            act(process)
        return self.end(process, met)

    def end(self, process: subprocess.Popen[bytes], met: bool = True) -> Outcome:
        """Wait for the end of a process that was started."""
        try:
            _, text = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            _, text = process.communicate()
            text += b"IT HANGS\n"
        return Outcome(process.returncode, text.decode(errors="replace"), met)

    def _wait(self, process: subprocess.Popen[bytes], moment: Moment | None) -> bool:
        """Watch `out` until the moment, or the end; whether the moment came first."""
        changes, before, peak, seconds = 0, self._listing(), 0, 0.0
        while process.poll() is None:
            now = self._listing()
            changes, before = changes + (now != before), now
            peak = max(peak, sum(size for _, size, _ in now))
            seconds = max(seconds, _processor_time(process.pid))
            if moment and (changes >= moment.change > 0 or 0.0 < moment.seconds <= seconds):
                return True
            time.sleep(0.005)
        if moment is None:
            self.seconds, self.changes = max(self.seconds, seconds), max(self.changes, changes)
            self.peak = max(self.peak, peak)
        return False

    def _listing(self) -> set[tuple[str, int, int]]:
        """Files under `out` with their sizes and times."""
        found = set()
        folders = [str(self.out)]
        while folders:
            with suppress(OSError), os.scandir(folders.pop()) as entries:
                for entry in entries:
                    with suppress(OSError):
                        if entry.is_dir():
                            folders.append(entry.path)
                        status = entry.stat()
                        size = status.st_size if not entry.is_dir() else 0
                        found.add((entry.path, size, status.st_mtime_ns))
        return found

    def _names(self) -> list[str]:
        return sorted(str(p.relative_to(self.out)) for p in self.out.rglob("*") if not p.is_dir())

    def _path(self, name: str) -> Path:
        return self.out / name

    def _is_output(self, name: str) -> bool:
        hidden = Path(name).name.startswith(".")
        return not hidden and any(fnmatch.fnmatch(name, p) for p in self.long.outputs)

    def _journals(self) -> list[str]:
        return [n for n in self.reference for p in self.long.journals if fnmatch.fnmatch(n, p)]

    def left(self) -> list[str]:
        """Temporary files in `out`."""
        return [name for name in self._names() if TEMPORARY.fullmatch(Path(name).name)]

    def with_other(self, name: str) -> dict[str, bytes]:
        """What is written where an input is another from the start."""
        self.begin()
        self.long.write_input(self.folder, name, other=True)
        done = self.run()
        assert done.code == 0, done.shown
        return {n: self._path(n).read_bytes() for n in self._names() if self._is_output(n)}

    def problems(
        self,
        outcome: Outcome,
        finished: bool = False,
        killed: bool = False,
        among: dict[str, bytes] | None = None,
    ) -> list[str]:
        """What does not hold, in words.

        Parameters
        ----------
        outcome
            Of the last run.
        finished
            Whether it had to get through.
        killed
            Whether it had no chance to tidy up, nor to say anything.
        among
            What may have been written as well, of a source that took the place of another; files
            may then leave out what the source was.
        """
        found = []
        if finished and outcome.code != 0:
            found.append(f"does not get through: {outcome.shown}")
        if not killed and outcome.code != 0:
            found += [f"ends badly: {outcome.shown}"] * (not _told(outcome, self.long.several))
        for name in self._names():
            if among is None or not self._of_either(name, among):
                found += self._of_file(name, tidy=not killed, finished=finished)
        if finished:
            found += [f"{n}: is missing" for n in self.reference if not self._path(n).exists()]
        else:
            found += [f"{n}: is lost" for n in self.old if not self._path(n).exists()]
        if (self.out / "mine.txt").read_bytes() != MINE:
            found.append("a file of the user's has changed")
        return found

    def _of_either(self, name: str, among: dict[str, bytes]) -> bool:
        """Whether a file is of one of two sources, and names no other than this."""
        if name not in among or name not in self.reference:
            return False
        content, made = self._path(name).read_bytes(), (self.reference[name], among[name])
        sources = [set(_SHA256.findall(data)) for data in made]
        return any(
            _numbers(content) == _numbers(data) and not set(_SHA256.findall(content)) - own
            for data, own in zip(made, sources, strict=True)
        )

    def _of_file(self, name: str, tidy: bool, finished: bool) -> list[str]:
        """What is wrong with a file in `out`."""
        if name == "mine.txt":
            return []
        if TEMPORARY.fullmatch(Path(name).name):
            return [f"{name}: is left behind"] if tidy else []
        content = self._path(name).read_bytes()
        if name in self._journals():
            return _damage(name, content, whole=finished)
        if name in self.reference:
            old = content == self.old.get(name) and not finished
            good = content == self.reference[name] or old
            return [] if good else [f"{name}: is not what an undisturbed run writes"]
        if any(fnmatch.fnmatch(name, pattern) for pattern in self.long.states) and not finished:
            return []
        return [f"{name}: is left behind when all is done" if finished else f"{name}: is unknown"]


def _numbers(content: bytes) -> object:
    """What a file holds, without the header of a safetensors file."""
    with suppress(SafetensorError):
        tensors = safetensors.numpy.load(content)
        return {name: (array.shape, array.tobytes()) for name, array in tensors.items()}
    return content


def _told(outcome: Outcome, several: bool) -> bool:
    """Whether an error was told as it should be: a line, or one for each of several results."""
    text = "\n" + outcome.text  # click ends the line of a terminal's ^C
    lines = re.split(r"\n(?=nacre: |gallery: )", text)[1:]  # terms of use may come before
    right = all(line.rstrip("\n").isprintable() for line in lines)
    code = outcome.code in ((1, 2, 130, 143) if several else (2, 130, 143))
    count = len(lines) == 1 or (several and len(lines) > 1)
    return code and right and count and not re.search("Traceback|Warning|Exception|HANGS", text)


def _damage(name: str, content: bytes, whole: bool) -> list[str]:
    """What is wrong with a file whose bytes vary: JSON is whole, and so is each line of a log when
    all is done.
    """
    lines = {".json": [content], ".jsonl": content.splitlines() if whole else []}
    try:
        for line in lines.get(Path(name).suffix, []):
            json.loads(line)
    except ValueError as error:
        return [f"{name}: is damaged: {error}"]
    return []


def _processor_time(process: int) -> float:
    """Seconds that a process has computed."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def running(group: int) -> list[int]:
    """Processes of a group that have not ended."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, of = path.read_text().rpartition(")")[2].split()[:3]
            if int(of) == group and state != "Z":
                found.append(int(path.parent.name))
    return found
