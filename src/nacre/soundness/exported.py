"""Shaders that were exported as C, compiled and called."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import FormatError, NacreError, printable
from nacre.io.files import PathLike, read_bytes
from nacre.soundness.design import STORED
from nacre.soundness.result import NotApplicableError
from nacre.soundness.subject import Drawn, Subject

ENDINGS = ".c", ".h"
_LIMIT = 1 << 26
_TIME_LIMIT = 120.0  # seconds that a compiler may take
_NAME = re.compile(r"^static inline void (\w{1,100})_eval_n\(", re.MULTILINE)
_HEAD = 4096
_NETWORK = re.compile(rb"^// Neural\w*Brdf, ", re.MULTILINE)
_CODE = """\
#include "shader.h"
void check_eval(size_t n, const float *wi, const float *wo, float *rgb) {{
    {name}_eval_n(n, wi, wo, rgb);
}}
"""
_SAMPLER = """\
void check_sample(size_t n, const float *wo, const float *u, float *wi, float *pdf) {{
    {name}_sample_n(n, wo, u, wi, pdf);
}}
void check_pdf(size_t n, const float *wi, const float *wo, float *pdf) {{
    {name}_pdf_n(n, wi, wo, pdf);
}}
"""


class ExportedC(Subject):
    """A header that `nacre export --to c` writes, or another with functions of these names.

    NAME_eval_n, and perhaps NAME_sample_n and NAME_pdf_n. The file is compiled by the compiler that
    the variable `CC` names, else by cc, gcc or clang, and what it says is run: check no file that
    you would not run.

    Raises
    ------
    FormatError
        If the file cannot be read, has no such function, or does not compile.
    NacreError
        If there is no compiler.
    """

    def __init__(self, path: PathLike) -> None:
        content = read_bytes(path, _LIMIT)
        found = _NAME.search(content.decode("utf-8", "replace"))
        if found is None:
            expected = "NAME_eval_n, as nacre export --to c writes it"
            raise FormatError(f"{path}: has no function {expected}")
        self.name = Path(path).name
        if _NETWORK.search(content[:_HEAD]):
            self.by_design = STORED
        sampled = f"{found[1]}_sample_n(".encode() in content
        code = _CODE + (_SAMPLER if sampled else "")
        self._library = _compiled(path, content, code.format(name=found[1]))
        self._sampled = sampled

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        rgb = np.empty((len(wi), 3), np.float32)
        self._call("check_eval", [wi, wo], [rgb])
        return rgb.astype(np.float64)

    def sample(self, wo: Floats, u: Floats) -> Drawn:
        if not self._sampled:
            raise NotApplicableError("it has no sampler")
        wi, pdf = np.empty((len(u), 3), np.float32), np.empty(len(u), np.float32)
        below_one = np.minimum(u, np.nextafter(np.float32(1.0), np.float32(0.0)))
        self._call("check_sample", [wo, below_one], [wi, pdf])
        return Drawn(wi.astype(np.float64), pdf.astype(np.float64))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        if not self._sampled:
            raise NotApplicableError("it has no density")
        pdf = np.empty(len(wi), np.float32)
        self._call("check_pdf", [wi, wo], [pdf])
        return pdf.astype(np.float64)

    def _call(self, name: str, given: Sequence[Floats], made: Sequence[Any]) -> None:
        arrays = [np.ascontiguousarray(array, np.float32) for array in given]
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (*arrays, *made)]
        self._library[name](ctypes.c_size_t(len(arrays[0])), *pointers)


def _compiled(path: PathLike, content: bytes, code: str) -> ctypes.CDLL:
    named = os.environ.get("CC", "")
    compiler = next(
        (c for c in ([named] if named else ["cc", "gcc", "clang"]) if shutil.which(c)), ""
    )
    if not compiler:
        raise NacreError(
            f"{path}: needs a C compiler ({named or 'cc, gcc or clang'}) to be checked"
        )
    with tempfile.TemporaryDirectory() as folder:
        header, library = Path(folder) / "shader.h", Path(folder) / "shader.so"
        header.write_bytes(content)
        command = [compiler, "-O2", "-shared", "-fPIC", "-I.", "-x", "c", "-", "-o", str(library)]
        command.append("-lm")
        try:
            done = subprocess.run(
                command, input=code.encode(), cwd=folder, capture_output=True, timeout=_TIME_LIMIT
            )
        except subprocess.TimeoutExpired as error:
            raise FormatError(f"{path}: takes more than {_TIME_LIMIT:g} s to compile") from error
        if done.returncode:
            said = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if line]
            first = next((line for line in said if "error" in line), said[0] if said else "failed")
            raise FormatError(f"{path}: does not compile: {printable(first)[:200]}")
        return ctypes.CDLL(str(library))
