# ruff: noqa: N802  (the names are those of CUDA)
"""CUDA without a card: kernels run on the processor, as `cuda.cpp` says."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

_FLAGS = (
    "-std=c++20 -O1 -shared -fPIC -pthread -fno-fast-math -ffp-contract=off -Wno-unknown-pragmas"
)

COMPILER = shutil.which("g++")


@functools.cache
def _library(source: bytes, kernel: str) -> bytes | str:
    """A shared library of a kernel, or what the compiler says against it."""
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder, "kernel.cu"), Path(folder, "kernel.so")
        given.write_bytes(source)
        code = Path(__file__).with_name("cuda.cpp")
        macros = f'-DSOURCE="{given}"', f"-DKERNEL={kernel}"
        command = [COMPILER or "g++", *_FLAGS.split(), *macros, str(code), "-o", str(made)]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        return made.read_bytes() if result.returncode == 0 else result.stderr


class EmulatedCuda:
    """Stands for the library of :func:`nacre.runtime.cuda_kernel.library`.

    Compilation is by g++, and a launch works on tensors of the processor. A card has the compute
    capability and the resources given here; an order of 0 runs threads by their numbers, another
    one shuffles them.
    """

    def __init__(
        self, capability: int = 90, multiprocessors: int = 132, shared: int = 227 << 10,
        order: int = 0,
    ) -> None:  # fmt: skip
        self._attributes = {
            16: multiprocessors, 75: capability // 10, 76: capability % 10, 97: shared,
        }  # fmt: skip
        self._order = order
        self.options: list[bytes] = []
        self.modules: list[ctypes.CDLL] = []

    @property
    def launches(self) -> int:
        return sum(int(module.emulated_launches()) for module in self.modules)

    def nvrtcCreateProgram(
        self, program: Any, source: Any, name: Any, headers: Any, texts: Any, names: Any
    ) -> Any:
        self._source = source
        program._obj.value = 1
        return 0

    def nvrtcCompileProgram(self, program: Any, count: Any, options: Any) -> Any:
        self.options = list(options)
        self._made = _library(self._source, "train")
        return 6 if isinstance(self._made, str) else 0

    def nvrtcGetProgramLogSize(self, program: Any, size: Any) -> None:
        size._obj.value = len(str(self._made).encode()) + 1

    def nvrtcGetProgramLog(self, program: Any, buffer: Any) -> None:
        buffer.value = str(self._made).encode()

    def nvrtcGetCUBINSize(self, program: Any, size: Any) -> None:
        size._obj.value = len(self._made)

    def nvrtcGetCUBIN(self, program: Any, buffer: Any) -> None:
        buffer.raw = self._made

    def nvrtcDestroyProgram(self, program: Any) -> None:
        program._obj.value = None

    def cuCtxGetDevice(self, device: Any) -> Any:
        return 0

    def cuDeviceGetAttribute(self, value: Any, name: Any, device: Any) -> Any:
        value._obj.value = self._attributes[name]
        return 0

    def cuModuleLoadData(self, module: Any, code: Any) -> Any:
        with tempfile.NamedTemporaryFile(suffix=".so") as file:
            file.write(code)
            file.flush()
            self.modules.append(ctypes.CDLL(file.name))
        self.modules[-1].emulate_order(self._order)
        return 0

    def cuModuleGetFunction(self, function: Any, module: Any, name: Any) -> Any:
        return 0 if name == b"train" else 500

    def cuFuncSetAttribute(self, function: Any, attribute: Any, value: Any) -> Any:
        return self.modules[-1].cuFuncSetAttribute(function, attribute, value)

    def cuLaunchKernel(self, function: Any, *arguments: Any) -> Any:
        return self.modules[-1].cuLaunchKernel(function, *arguments)

    def cuGetErrorString(self, status: Any, words: Any) -> Any:
        words._obj.value = b"emulated"
        return 0
