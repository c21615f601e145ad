"""C headers, compiled by GCC as C99 and as C++."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW, Runner, best_rate

WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wdouble-promotion")

_WRAPPER = """\
#include "{name}.h"
#ifdef __cplusplus
#define EXPORTED extern "C"
#else
#define EXPORTED
#endif
typedef const float *Given;
EXPORTED void run_eval(size_t n, Given a, Given b, float *rgb, float *pdf);
EXPORTED void run_sample(size_t n, Given a, Given b, float *wi, float *pdf);
EXPORTED void run_pdf(size_t n, Given a, Given b, float *rgb, float *pdf);
void run_eval(size_t n, Given a, Given b, float *rgb, float *pdf) {{
    (void)pdf;
    {name}_eval_n(n, a, b, rgb);
}}
void run_sample(size_t n, Given a, Given b, float *wi, float *pdf) {{
    {name}_sample_n(n, a, b, wi, pdf);
}}
void run_pdf(size_t n, Given a, Given b, float *rgb, float *pdf) {{
    (void)rgb;
    {name}_pdf_n(n, a, b, pdf);
}}
"""


def build(command: Sequence[str], code: str, files: Mapping[str, bytes], output: Path) -> None:
    """Compile code that includes files beside it; RuntimeError with the compiler's words."""
    for name, content in files.items():
        (output.parent / name).write_bytes(content)
    result = subprocess.run(
        [*command, "-o", str(output), "-", "-lm"],
        input=code.encode(),
        cwd=output.parent,
        capture_output=True,
    )
    if result.returncode:
        raise RuntimeError(result.stderr.decode())


class Gcc(Runner):
    """Shared libraries, called through ctypes."""

    target = "c"
    title = "gcc"
    tool: ClassVar[str] = "gcc"
    language: ClassVar[Sequence[str]] = ("-std=c99", "-x", "c")
    options: ClassVar[Sequence[str]] = ("-O3", "-march=native")

    def __init__(self) -> None:
        self._built: dict[bytes, ctypes.CDLL] = {}

    def missing(self) -> str | None:
        return None if shutil.which(self.tool) else self.tool

    def library(self, files: Mapping[str, bytes], name: str) -> ctypes.CDLL:
        """The functions `run_eval`, `run_sample` and `run_pdf` of a header."""
        header = files[f"{name}.h"]
        if header not in self._built:
            options = [*self.language, *self.options, *WARNINGS, "-shared", "-fPIC", "-I."]
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "functions.so"
                build([self.tool, *options], _WRAPPER.format(name=name), files, path)
                self._built[header] = ctypes.CDLL(str(path))
        return self._built[header]

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        """See :meth:`tests.oracles.runner.Runner.run`."""
        vectors = np.full((len(a), 3), np.nan, np.float32)
        densities = np.full(len(a), np.nan, np.float32)
        self._call(files, name, function, a, b, vectors, densities)
        if function == "sample":
            return np.concatenate([vectors, densities[:, None]], axis=1)
        return vectors if function == "eval" else densities

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        """See :meth:`tests.oracles.runner.Runner.rate`."""
        out = np.empty((len(a), 3), np.float32)
        return best_rate(lambda: self._call(files, name, "eval", a, b, out, out), len(a))

    def _call(self, files: Mapping[str, bytes], name: str, function: str, *arrays: Weights) -> None:
        whole = [np.ascontiguousarray(array, np.float32) for array in arrays]
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in whole]
        run = getattr(self.library(files, name), f"run_{function}")
        run.restype = None
        run(ctypes.c_size_t(len(arrays[0])), *pointers)


class Gxx(Gcc):
    """The same header as C++."""

    title = tool = "g++"
    materials = FEW
    language = ("-std=c++17", "-x", "c++")
