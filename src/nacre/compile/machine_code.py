"""Machine code as object files: kept on disk, loaded into this process, called by an address."""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm

_DIGEST = 32  # bytes before the code in a file: a damaged one could do anything


def target() -> Any:
    """What code is compiled for; an engine takes it for its own."""
    if llvm.llvm_version_info[0] < 20:  # later ones do so by themselves
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple = llvm.Target.from_default_triple()
    features = llvm.get_host_cpu_features().flatten()
    cpu = llvm.get_host_cpu_name()
    return triple.create_target_machine(cpu=cpu, features=features, opt=2, jit=True)


def load(code: bytes, kind: Any) -> tuple[Any, Any]:
    """The function `run` of an object file, of a type of ctypes, and what keeps it in memory.

    It is called without the interpreter lock.
    """
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return kind(engine.get_function_address("run")), engine


def kept(path: Path, make: Callable[[], bytes]) -> bytes:
    """The object file at a path; one that is absent or damaged is made, and written if possible."""
    with suppress(OSError):
        found = path.read_bytes()
        if hashlib.sha256(found[_DIGEST:]).digest() == found[:_DIGEST]:
            return found[_DIGEST:]
    code = make()
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}")  # only one thread at a time gets here
        try:
            part.write_bytes(hashlib.sha256(code).digest() + code)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    return code


def function_type(*arguments: Any) -> Any:
    """The type of functions that return an int of 32 bits."""
    return ctypes.CFUNCTYPE(ctypes.c_int32, *arguments)
