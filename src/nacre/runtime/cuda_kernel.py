"""CUDA kernels from source, compiled and launched beside PyTorch by the libraries that it brings.

PyTorch's wheels for CUDA depend on NVRTC, a compiler that needs neither headers nor a toolkit, and
their `libcaffe2_nvrtc` is linked with NVRTC and with the driver: one library has the functions of
both. `torch.cuda._compile_kernel` does the same, but only beside an installed toolkit.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nacre.errors import require

_MULTIPROCESSORS, _MAJOR, _MINOR, _SHARED_MEMORY = 16, 75, 76, 97  # CUdevice_attribute
_DYNAMIC_SHARED_MEMORY = 8  # CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES

_OPTIONS = b"--std=c++17", b"--prec-div=false", b"--prec-sqrt=false"  # both are good to 2 ulp


class CudaError(RuntimeError):
    """What NVRTC or the driver refused, and its words for it."""


@functools.cache
def library() -> ctypes.CDLL:
    """The functions of NVRTC and of the driver; CudaError where PyTorch has no such library."""
    torch = require("torch", "torch")
    path = Path(torch.__path__[0], "lib", "libcaffe2_nvrtc.so")
    try:
        found = ctypes.CDLL(str(path))
        _ = found.nvrtcCreateProgram, found.cuLaunchKernel  # an AttributeError where they are not
        return found
    except (OSError, AttributeError) as error:
        raise CudaError(f"{path.name} does not load: {error}") from error


class Card:
    """The card of the current CUDA context, as far as kernels must know it."""

    def __init__(self, functions: ctypes.CDLL) -> None:
        self._functions, self._device = functions, ctypes.c_int()
        _check(functions, functions.cuCtxGetDevice(ctypes.byref(self._device)))
        self.multiprocessors = self._attribute(_MULTIPROCESSORS)
        self.capability = 10 * self._attribute(_MAJOR) + self._attribute(_MINOR)
        self.shared_memory = self._attribute(_SHARED_MEMORY)  # bytes that one block may have

    def _attribute(self, name: int) -> int:
        value = ctypes.c_int()
        status = self._functions.cuDeviceGetAttribute(ctypes.byref(value), name, self._device)
        _check(self._functions, status)
        return value.value


class CudaKernel:
    """The function `name` of a source, loaded into the current CUDA context.

    It is compiled for a compute capability such as 90, with macros, and may use so many bytes of
    shared memory. Raises CudaError, with the compiler's words where it refuses the source.
    """

    def __init__(
        self, source: str, name: str, macros: Mapping[str, object], capability: int, shared: int,
        functions: ctypes.CDLL,
    ) -> None:  # fmt: skip
        defined = "".join(f"#define {key} {value}\n" for key, value in macros.items())
        code = compiled(defined + source, capability, functions)
        module, self._function = ctypes.c_void_p(), ctypes.c_void_p()
        self._functions, self._shared = functions, shared
        _check(functions, functions.cuModuleLoadData(ctypes.byref(module), code))
        place = ctypes.byref(self._function)
        _check(functions, functions.cuModuleGetFunction(place, module, name.encode()))
        limit = self._function, _DYNAMIC_SHARED_MEMORY, shared
        _check(functions, functions.cuFuncSetAttribute(*limit))

    def launch(self, blocks: int, threads: int, stream: int, *arguments: Any) -> None:
        """Start it on a stream (0 for the default one); tensors are passed as their addresses."""
        values = [
            ctypes.c_int(each) if isinstance(each, int) else ctypes.c_void_p(each.data_ptr())
            for each in arguments
        ]
        places = (ctypes.c_void_p * len(values))(*map(ctypes.addressof, values))
        status = self._functions.cuLaunchKernel(
            self._function, blocks, 1, 1, threads, 1, 1, self._shared, ctypes.c_void_p(stream),
            places, None,
        )  # fmt: skip
        _check(self._functions, status)


@functools.cache
def compiled(source: str, capability: int, functions: ctypes.CDLL) -> bytes:
    """Machine code of a source for a compute capability; CudaError says what is wrong with it."""
    program, size = ctypes.c_void_p(), ctypes.c_size_t()

    def text(of: Callable[..., int], content: Callable[..., int]) -> bytes:
        of(program, ctypes.byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        content(program, buffer)
        return buffer.raw

    options = [f"--gpu-architecture=sm_{capability}".encode(), *_OPTIONS]
    created = functions.nvrtcCreateProgram(
        ctypes.byref(program), source.encode(), b"nacre.cu", 0, None, None
    )
    if created:
        raise CudaError(f"NVRTC does not start: error {created}")
    try:
        given = (ctypes.c_char_p * len(options))(*options)
        if functions.nvrtcCompileProgram(program, len(options), given):
            log = text(functions.nvrtcGetProgramLogSize, functions.nvrtcGetProgramLog)
            raise CudaError(f"NVRTC: {log.decode(errors='replace').strip(chr(0)).strip()}")
        return text(functions.nvrtcGetCUBINSize, functions.nvrtcGetCUBIN)
    finally:
        functions.nvrtcDestroyProgram(ctypes.byref(program))


def _check(functions: ctypes.CDLL, status: int) -> None:
    if status:
        words = ctypes.c_char_p()
        functions.cuGetErrorString(status, ctypes.byref(words))
        raise CudaError(f"CUDA: {(words.value or b'unknown error').decode()} ({status})")
