"""Install the built wheels in many environments, and try in each what they should do.

`python scripts/matrix.py [ROW...]`, or `make matrix`; ROW is a part of a row's name. Needs `uv` on
the path or in this Python's environment, and the project's own environment, in which the tests make
a file of each format. Every row is a temporary environment of its own: without extras and with
`render` on each Python, each extra alone, the oldest releases of what is declared, and the lab.
Prints a table in Markdown; the exit code is 1 where a row failed. A row whose Python cannot be had
is not run, and says so.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOWEST = "lowest-direct"
"""The oldest releases that pyproject.toml declares, with the newest of what those need."""
TIME_LIMIT = 1200
"""Seconds that one step may take."""

MEASUREMENT = """
import nacre
from nacre.analytic import Ggx
nacre.save(Ggx(diffuse=(0.2, 0.1, 0.1), specular=(0.3, 0.2, 0.1), roughness=0.3), "paint.bsdf")
"""
INCLUDED = """
import nacre, nacre.latent
for name in ("merl:chrome", "captured:tweed"):
    print(nacre.load(name))
print(nacre.latent.pretrained_basis())
"""
READ = """
import importlib.util, json, pathlib, sys, numpy, nacre
from nacre.formats import formats
folder, up = pathlib.Path(sys.argv[1]), numpy.array([0.0, 0.6, 0.8])
index, read = json.loads((folder / "index.json").read_text()), set()
for entry in index:
    if entry["needs"] and not importlib.util.find_spec(entry["needs"]):
        continue
    material = nacre.load(folder / entry["path"])
    if isinstance(material, nacre.Btf):
        values = material.texels(slice(0, 1))
    else:
        values = material.eval(up, up * [1.0, -1.0, 1.0])
    assert numpy.isfinite(values).all(), entry
    read.add(entry["format"])
left = {entry.name for entry in formats()} - read
if importlib.util.find_spec("mitsuba"):
    assert not left, left
print(f"read {len(read)} formats; not {sorted(left)}")
"""
"""A file of each documented format is read; without Mitsuba, of those that are no images."""
SPECIMENS = "specimens"
"""The folder with these files, in the one that steps run in."""
FIT = "-m", "nacre", "fit", "paint.bsdf", "--preset", "draft", "-o", "paint.safetensors"
REFUSED = """
import subprocess, sys
for name in ("reproduce", "bench"):
    command = [sys.executable, "-m", "nacre", name]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2, done
    assert done.stderr.count("\\n") == 1 and "pip install nacre-lab" in done.stderr, done.stderr
"""
"""The lab's commands say in a line what to install for them."""
COMMON = (
    ("-c", INCLUDED),
    ("-c", READ, SPECIMENS),
    ("-c", MEASUREMENT),
    FIT,
    ("-m", "nacre", "info", "paint.safetensors"),
)
"""What works without extras, as arguments of Python: what comes with nacre is read, a file of each
format too, and a file is written, fitted and shown.
"""

NACRE = "-m", "nacre"
WEB = ((*NACRE, "view", "paint.safetensors", "-o", "page.html"),)
LAB = "lab"
"""In place of an extra: the lab's wheel too, which names the extras that it needs."""
SMOKE: dict[str, tuple[tuple[str, ...], ...]] = {
    "": (
        ("-c", REFUSED),
        (*NACRE, "export", "paint.safetensors", "--to", "glsl", "-o", "paint.glsl"),
        *WEB,
    ),
    "render": (
        (*NACRE, "demo", "--preset", "draft", "--spp", "4", "-o", "demo.png"),
        (*NACRE, "render", "paint.safetensors", "--spp", "4", "-o", "ball.png"),
        (*NACRE, "compare", "paint.bsdf", "paint.safetensors", "-o", "compared.png"),
        *WEB,
        ("-c", REFUSED),
    ),
    "plot": ((*NACRE, "plot", "paint.safetensors", "-o", "lobes.pdf"),),
    "torch": (("-c", "import nacre.neural.torch_module, nacre.latent.torch"),),
    "jax": (("-c", "import jax, nacre"),),
    "latent": (("-c", "import openTSNE, nacre.latent.neural_training"),),
    "btf": (("-c", "import tensorboardX, nacre.textures.codecs"),),
    "export": ((*NACRE, "export", "paint.safetensors", "--to", "onnx", "-o", "paint.onnx"),),
    "notebook": (("-c", "import nacre.viewer.notebook, nacre.viewer.widget"),),
    "cluster": (("-c", "import distributed, nacre.workflows.cluster"),),
    LAB: ((*NACRE, "reproduce", "--list"), (*NACRE, "bench", "--list")),
}
"""What each extra adds, and the lab, as arguments of Python, tried after :data:`COMMON`."""


@dataclass(frozen=True)
class Row:
    """One environment.

    Parameters
    ----------
    python
        Version of Python, as `uv` takes it.
    extra
        Extra of the package; empty for none; :data:`LAB` for the lab.
    resolution
        As `uv pip install --resolution` takes it.
    """

    python: str
    extra: str = ""
    resolution: str = "highest"

    @property
    def name(self) -> str:
        """Python, extra and resolution in one word."""
        return "-".join((self.python, self.extra or "none", self.resolution))


def rows() -> Iterator[Row]:
    """Every environment."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [extra for extra in declared["optional-dependencies"] if extra != "all"]
    pythons = [
        text.rpartition(" ")[2]
        for text in declared["classifiers"]
        if text.startswith("Programming Language :: Python :: 3.")
    ]
    yield from (Row(python) for python in pythons)
    yield from (Row(python, "render") for python in pythons)
    yield from (Row(pythons[0], extra) for extra in extras if extra != "render")
    yield from (Row(pythons[0], extra, LOWEST) for extra in ("", *extras))
    yield Row(pythons[0], LAB)


def found_uv() -> str:
    """Path of `uv`; ends where there is none."""
    beside = Path(sys.executable).with_name("uv")
    path = str(beside) if beside.exists() else shutil.which("uv")
    if path is None:
        sys.exit("matrix: needs uv: python -m pip install uv")
    return path


def run(command: list[str], folder: Path) -> str:
    """Run a command; what is wrong with it, empty where nothing is."""
    # Only what is installed counts, not the checkout.
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
        )
    except subprocess.TimeoutExpired:
        return f"took more than {TIME_LIMIT} s"
    if done.returncode == 0:
        return ""
    return (done.stderr.strip() or done.stdout.strip() or f"exit {done.returncode}")[-600:]


def packages(row: Row) -> list[str]:
    """What a row installs, of the wheels in out/release."""
    release = ROOT / "out" / "release"
    found = [[*release.glob(f"{name}-*.whl")] for name in ("nacre_materials", "nacre_lab")]
    if any(len(wheels) != 1 for wheels in found):
        sys.exit("matrix: needs one wheel of each package in out/release: make release")
    nacre, lab = (str(wheel) for (wheel,) in found)
    if row.extra == LAB:
        return [nacre, lab]
    return [f"{nacre}[{row.extra}]" if row.extra else nacre]


def write_specimens(folder: Path) -> None:
    """Have the project's tests write a file of each format."""
    python = next((p for p in (ROOT / ".venv").glob("*/python*") if p.stem == "python"), None)
    if python is None:
        sys.exit("matrix: needs the project's environment: make setup")
    done = subprocess.run([str(python), "-m", "tests.specimens", str(folder)], cwd=ROOT)
    if done.returncode:
        sys.exit("matrix: the files of all formats could not be written")


def try_row(row: Row, uv: str, specimens: Path) -> str:
    """Install wheels in a new environment and try them; the problem, empty where there is none."""
    binaries = "Scripts" if os.name == "nt" else "bin"
    with tempfile.TemporaryDirectory() as work, tempfile.TemporaryDirectory() as environment:
        python = str(Path(environment) / binaries / "python")
        install = [uv, "pip", "install", "-q", "--python", python, "--resolution", row.resolution]
        steps = [
            [uv, "venv", "-q", "--clear", "--python", row.python, environment],
            [*install, "--only-binary", ":all:", *packages(row)],
            [uv, "pip", "check", "-q", "--python", python],
            *([python, *arguments] for arguments in (*COMMON, *SMOKE[row.extra])),
        ]
        shutil.copytree(specimens, Path(work) / SPECIMENS)
        for step in steps:
            if problem := run(step, Path(work)):
                return f"{' '.join(step[1:4])}: {problem}"
    return ""


@cache
def available(uv: str, python: str) -> bool:
    """Whether there is this Python, or uv can fetch it."""
    asked = ([uv, "python", verb, "-q", python] for verb in ("find", "install"))
    return any(subprocess.run(each, capture_output=True).returncode == 0 for each in asked)


def main(parts: list[str]) -> int:
    """Try the rows whose names hold any of the parts, or all; the exit code."""
    uv, failed = found_uv(), 0
    with tempfile.TemporaryDirectory() as folder:
        specimens = Path(folder) / SPECIMENS
        write_specimens(specimens)
        print("| Python | extra | releases | outcome |\n|---|---|---|---|", flush=True)
        for row in rows():
            if parts and not any(part in row.name for part in parts):
                continue
            about = f"{row.python} | {row.extra or 'none'} | {row.resolution}"
            if not available(uv, row.python):
                print(f"| {about} | not run: uv cannot get this Python |", flush=True)
                continue
            problem = try_row(row, uv, specimens)
            failed += bool(problem)
            lines = [line.strip() for line in problem.splitlines() if line.strip()]
            outcome = lines[-1].replace("|", "/") if lines else "passes"
            print(f"| {about} | {outcome} |", flush=True)
            if problem:
                print(problem, file=sys.stderr, flush=True)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
