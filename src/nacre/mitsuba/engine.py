"""Mitsuba, started on a device that works."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from nacre.errors import NacreError, did_you_mean, require
from nacre.io.image_file import bitmaps
from nacre.io.memory import available_memory
from nacre.mitsuba import llvm

DEFAULT_VARIANT = "llvm_ad_rgb"

VARIANTS = DEFAULT_VARIANT, "cuda_ad_rgb"

VARIABLE = "NACRE_VARIANT"
"""Environment variable that chooses the variant to start with, one of :data:`VARIANTS`."""

_MIN_MEMORY = 192 << 20  # bytes for threads and kernels; with less, LLVM ends the process


class LLVMError(NacreError, RuntimeError):
    """No LLVM that Dr.Jit can use; the message says what to install."""


def mitsuba(variant: str | None = None) -> Any:
    """The `mitsuba` module with a variant set.

    Parameters
    ----------
    variant
        Variant to set if none is set yet; by default what :data:`VARIABLE` names, else
        :data:`DEFAULT_VARIANT`. A variant that the caller has set stays.

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If the variant compiles with LLVM and there is none of release 17 or newer.
    NacreError
        If there is too little memory to render anything, the variable names no such variant, or
        the variant takes a CUDA device and there is none.
    """
    llvm.prepare()
    mi = bitmaps()
    current = mi.variant()
    chosen = current or variant or _usual_variant()
    _check_device(chosen)
    if current is None:
        mi.set_variant(chosen)
    return mi


@contextmanager
def variant_in_use(name: str | None) -> Iterator[Any]:
    """A block in which Mitsuba has a variant: one that it lists, or what is set where None.

    Afterwards the variant that was set before is back. Raises NacreError if there is no such
    variant, and as :func:`mitsuba`.
    """
    llvm.prepare()
    mi = bitmaps()
    before = mi.variant()
    if name is None:
        yield mitsuba()
        return
    if name not in (known := mi.variants()):
        hint = did_you_mean(name, known)
        raise NacreError(f"Mitsuba has no variant {name!r} (it has {', '.join(known)}){hint}")
    _check_device(name)
    mi.set_variant(name)
    try:
        yield mi
    finally:
        if before is not None:
            mi.set_variant(before)


def _check_device(variant: str) -> None:
    """Refuse a variant whose device is not there."""
    if variant.startswith("llvm"):
        check_llvm()
    if variant.startswith("cuda") and not has_cuda():
        raise NacreError(f"{variant} needs a CUDA device and its driver: Dr.Jit finds none")


def _usual_variant() -> str:
    named = os.environ.get(VARIABLE, "")
    if named and named not in VARIANTS:
        raise NacreError(f"{VARIABLE} is {named!r}: give {' or '.join(VARIANTS)}")
    return named or DEFAULT_VARIANT


def has_cuda() -> bool:
    """Whether Dr.Jit finds a CUDA device."""
    dr = require("drjit", "render")
    return bool(dr.has_backend(dr.JitBackend.CUDA))


@cache
def check_llvm() -> None:
    """Refuse an LLVM that would end the process; a successful check is not repeated.

    Raises LLVMError if there is no LLVM of release 17 or newer, or it does not load; NacreError if
    there is too little memory to render anything.
    """
    drjit = require("drjit", "render")
    # Before Dr.Jit starts: if it cannot load a library or start a thread, the exit may crash.
    if refused := llvm.failure():
        raise LLVMError(refused)
    available = available_memory()
    if available is not None and available < _MIN_MEMORY:
        raise NacreError(
            f"not enough memory to render: {available >> 20} MiB are left; free some, or raise "
            "ulimit -v"
        )
    if refused := llvm.refusal(drjit.detail.llvm_version()):
        raise LLVMError(refused)
