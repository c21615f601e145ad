"""The target `slang`: slangc makes C++ of a compute shader, g++ builds it, ctypes calls it."""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW, Runner, best_rate

TARGETS = "cpp", "cuda", "glsl", "hlsl", "metal", "wgsl"
"""What slangc can make of a module without tools beside it."""

VALUES = {
    "eval": "float4({name}_eval(a[id.x].xyz, b[id.x].xyz), 0.0)",
    "sample": "{name}_sample(a[id.x].xyz, b[id.x].xyz)",
    "pdf": "float4({name}_pdf(a[id.x].xyz, b[id.x].xyz), 0.0, 0.0, 0.0)",
}
"""What a shader computes of element `id.x` of buffers a and b, by entry point: each function."""

_GROUP = 64  # threads that a group has
_BUFFERS = """import {name};

StructuredBuffer<float4> a;
StructuredBuffer<float4> b;
RWStructuredBuffer<float4> result;
"""
_ENTRY = """
[shader("compute")]
[numthreads({group}, 1, 1)]
void run_{entry}(uint3 id : SV_DispatchThreadID)
{{
    result[id.x] = {value};
}}
"""
_PARTS: Mapping[str, Any] = {"eval": np.s_[:, :3], "sample": np.s_[:], "pdf": np.s_[:, 0]}
_FLAGS = "-std=c++17", "-march=native", "-w", "-shared", "-fPIC"  # the prelude has warnings
QUICK, FAST = "-O1", "-O3"
"""Levels of optimization: for an answer, and for a rate."""


class Slang(Runner):
    """C++ is what a machine without a graphics card runs of Slang."""

    target = "slang"
    title = "C++ by slangc and g++"
    materials = FEW

    def missing(self) -> str | None:
        return missing() or (None if shutil.which("g++") else "g++")

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        call = Call(built(files, shader(name)), function, a, b)
        call()
        return call.result[_PARTS[function]]

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return best_rate(Call(built(files, shader(name), FAST), "eval", a, b), len(a))


def missing() -> str | None:
    """What has to be installed before slangc runs; None where nothing is."""
    return None if slangc() else "slangc (pip install slangtorch)"


def slangc() -> str | None:
    """Where the compiler is: on the path, or in the package `slangtorch`, which is not imported."""
    package = importlib.util.find_spec("slangtorch")
    inside = Path(package.origin).parent / "bin" if package and package.origin else None
    return shutil.which("slangc") or (inside and shutil.which("slangc", path=inside))


def shader(name: str, values: Mapping[str, str] = VALUES) -> str:
    """A compute shader with an entry point `run_KEY` for each of some values.

    Buffers are of four floats an element: a at binding 0, b at 1, result at 2.

    Parameters
    ----------
    name
        Identifier of the material; it stands for {name} in values.
    values
        Expressions of type float4, by the names of entry points.
    """
    entries = (
        _ENTRY.format(group=_GROUP, entry=entry, value=value.format(name=name))
        for entry, value in values.items()
    )
    return _BUFFERS.format(name=name) + "".join(entries)


def compiled(
    folder: Path, files: Mapping[str, bytes], text: str, target: str, entry: str | None = None
) -> Path:
    """The file that slangc makes of a shader that imports a material.

    Parameters
    ----------
    folder
        Takes the material, the shader and what becomes of it.
    files
        Of the material.
    text
        The shader.
    target
        One of :data:`TARGETS`.
    entry
        The one entry point that is compiled, which GLSL and HLSL ask for; all where None.

    Raises
    ------
    RuntimeError
        If it does not compile: what the compiler says.
    """
    for file, content in files.items():
        (folder / file).write_bytes(content)
    source, made = folder / "shader.slang", folder / f"shader.{target}"
    source.write_text(text)
    options = "-target", target, "-line-directive-mode", "none"
    chosen = ["-entry", f"run_{entry}"] if entry else []
    execute(slangc() or "slangc", source, *options, *chosen, "-o", made)
    return made


def built(files: Mapping[str, bytes], text: str, level: str = QUICK) -> ctypes.CDLL:
    """The entry points of a shader, made C++ and compiled; raises as :func:`compiled` does."""
    return _library(tuple(files.items()), text, level)


def linked(source: Path, level: str = QUICK) -> ctypes.CDLL:
    """A library of C++; raises as :func:`compiled` does."""
    library = source.with_suffix(".so")
    execute("g++", *_FLAGS, level, source, "-o", library)
    return ctypes.CDLL(str(library))


@functools.cache
def _library(files: tuple[tuple[str, bytes], ...], text: str, level: str) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        return linked(compiled(Path(folder), dict(files), text, "cpp"), level)


def execute(*command: str | Path) -> None:
    """Run a command; RuntimeError with its words where it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr or done.stdout)


class _Buffer(ctypes.Structure):
    """A buffer of the C++ that slangc makes: its elements, and how many there are."""

    _fields_ = (("data", ctypes.c_void_p), ("count", ctypes.c_size_t))


class Call:
    """A call of an entry point: :attr:`result` is what it finds, shape (n, 4).

    Parameters
    ----------
    library
        See :func:`built`.
    entry
        Its name.
    a, b
        Float32 of shape (n, 3).
    """

    def __init__(self, library: ctypes.CDLL, entry: str, a: Weights, b: Weights) -> None:
        groups = -(-len(a) // _GROUP)
        self._entry = getattr(library, f"run_{entry}")
        self._arrays = [np.zeros((groups * _GROUP, 4), np.float32) for _ in range(3)]
        for array, given in zip(self._arrays, (a, b), strict=False):
            array[: len(a), :3] = given
        self.result = self._arrays[-1][: len(a)]
        self._buffers = (_Buffer * 3)(*(_Buffer(x.ctypes.data, len(x)) for x in self._arrays))
        self._groups = (ctypes.c_uint32 * 6)(0, 0, 0, groups, 1, 1)  # first, and beyond the last

    def __call__(self) -> None:
        self._entry(self._groups, None, self._buffers)
