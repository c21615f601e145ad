"""CUDA that slangc makes of the target `slang`, compiled by NVRTC and run on a graphics card."""

from __future__ import annotations

import ctypes
import importlib.util
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW
from tests.oracles.runners import slang
from tests.oracles.runners.slang_shaders import LOOP, main
from tests.oracles.runners.vulkan import GROUP, MAX_GROUPS
from tests.oracles.shaders import Pass, ShaderRunner


class SlangCuda(ShaderRunner):
    """Compute shaders in Slang, as CUDA kernels."""

    target = "slang"
    title = "CUDA by slangc, NVRTC"
    materials = FEW
    vector, loop = "float4", LOOP

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        if reason := slang.missing():
            return reason
        if importlib.util.find_spec("cupy") is None:
            return "a CUDA device and CuPy (pip install cupy-cuda13x)"
        import cupy

        try:
            cupy.cuda.runtime.getDeviceCount()
        except cupy.cuda.runtime.CUDARuntimeError as error:
            return f"a CUDA device ({error})"
        return None

    def compiled(self, source: str, call: str, a: Weights, b: Weights) -> Pass:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        with tempfile.TemporaryDirectory() as folder:
            made = slang.compiled(Path(folder), {}, source + main(call), "cuda", "all")
            return CudaPass(made.read_text(), a, b)


class CudaPass(Pass):
    """A kernel `run_all` of CUDA as slangc writes it, whose buffers lie in a constant."""

    def __init__(self, code: str, a: Weights, b: Weights) -> None:
        import cupy

        module = cupy.RawModule(code=code, options=("--std=c++17",))
        try:
            self._kernel = module.get_function("run_all")
        except cupy.cuda.compiler.CompileException as error:
            raise RuntimeError(str(error)) from error
        inputs = [cupy.asarray(np.ascontiguousarray(vectors, np.float32)) for vectors in (a, b)]
        self._results: Any = cupy.empty((len(a), 4), np.float32)
        self._buffers = [*((array, array.size) for array in inputs), (self._results, len(a))]
        given = np.array([(array.data.ptr, count) for array, count in self._buffers], np.uint64)
        constant = module.get_global("SLANG_globalParams")
        constant.copy_from_host(given.ctypes.data_as(ctypes.c_void_p), given.nbytes)
        groups = -(-len(a) // GROUP)
        self._grid = min(groups, MAX_GROUPS), -(-groups // MAX_GROUPS)
        self._wait = cupy.cuda.runtime.deviceSynchronize

    def execute(self) -> None:
        self._kernel(self._grid, (GROUP,), ())
        self._wait()

    def read(self) -> Weights:
        found: Weights = self._results.get()
        return found
