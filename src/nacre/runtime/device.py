"""Devices of PyTorch and Dr.Jit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from nacre.errors import NacreError, reason, require

# Imported when it is first used: a caller that needs more than PyTorch has named its own extra.


def open_device(device: str) -> Any:
    """The PyTorch device of a name: "cpu", "cuda", "cuda:1"; a NacreError if there is none."""
    torch = require("torch", "torch")
    try:
        opened = torch.device(device)
        float(torch.bmm(*torch.ones((2, 1, 1, 1), device=opened)))
    except Exception as error:  # devices fail in ways of their own
        raise NacreError(f"device {device!r} cannot be used: {reason(error)}") from error
    return opened


@contextmanager
def memory_errors(device: str) -> Iterator[None]:
    """A block in which running out of memory is an error of one line."""
    torch = require("torch", "torch")
    try:
        yield
    except torch.OutOfMemoryError as error:
        raise NacreError(f"device {device!r}: {reason(error)}") from error


@contextmanager
def one_thread() -> Iterator[None]:
    """A block in which PyTorch takes one thread.

    Matrices are small: more threads gain little, and lose far more where cores are busy.
    """
    torch = require("torch", "torch")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def cooperative_type(array: Any) -> Any:
    """What cooperative vectors hold on the backend of a Dr.Jit type, such as `mi.Float`.

    That type itself; on CUDA one of 16 bits, as Dr.Jit arranges no other matrices there.
    """
    dr = require("drjit", "render")
    cuda = dr.backend_v(array) is dr.JitBackend.CUDA
    return dr.float16_array_t(array) if cuda else array


def matrix_views(packed: Sequence[Any]) -> list[Any]:
    """The matrices that `drjit.nn.pack` or `unpack` gives; Dr.Jit 1.2 puts a buffer before them."""
    view = require("drjit.nn", "render").MatrixView
    return [each for each in packed if isinstance(each, view)]
