"""Arrays from outside: lists of numbers, and arrays of libraries that share memory by DLPack."""

from __future__ import annotations

import functools
import importlib.util
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from nacre.array import LIBRARIES

_Method = TypeVar("_Method", bound=Callable[..., Any])
_IN_MEMORY = 1, 3  # kinds of devices in DLPack: the CPU, and memory of the CPU that a GPU sees


def numbers(given: npt.ArrayLike) -> npt.NDArray[Any]:
    """An array of what was given; integers, and Python's own numbers in lists or tuples, in single
    precision.

    Examples
    --------
    >>> import numpy as np
    >>> numbers([0.0, 0, 1]).dtype, numbers(np.array([0.0, 0.0, 1.0])).dtype
    (dtype('float32'), dtype('float64'))
    """
    array = np.asarray(given)
    python = array.dtype == np.float64 and isinstance(given, list | tuple)
    return array.astype(np.float32) if python or array.dtype.kind in "iu" else array


def any_library(*, on_device: bool = False) -> Callable[[_Method], _Method]:
    """Have a method take arrays of any library with `__dlpack__`, such as CuPy, and return its
    arrays.

    They are evaluated by NumPy on the CPU. With `on_device`, those on another device are given to
    the method as PyTorch tensors where PyTorch is installed and the object is `traceable`. Arrays
    of NumPy, PyTorch, JAX and Dr.Jit are passed as they are.
    """

    def decorated(method: _Method) -> _Method:
        @functools.wraps(method)
        def call(self: Any, *given: Any, **named: Any) -> Any:
            first = next((a for a in (*given, *named.values()) if _is_foreign(a)), None)
            if first is None:
                return method(self, *given, **named)
            taken = _as_numpy
            if on_device and self.traceable and _torch_takes(first):
                taken = _as_tensor
            found = method(
                self, *map(taken, given), **{name: taken(a) for name, a in named.items()}
            )
            if isinstance(found, tuple):
                return tuple(_returned(each, first) for each in found)
            return _returned(found, first)

        return cast(_Method, call)

    return decorated


def _is_foreign(array: object) -> bool:
    kind = type(array)
    return (
        hasattr(kind, "__dlpack__")
        and not isinstance(array, np.ndarray | np.generic)
        and kind.__module__.partition(".")[0] not in LIBRARIES
    )


def _in_memory(array: Any) -> bool:
    return array.__dlpack_device__()[0] in _IN_MEMORY


def _torch_takes(array: Any) -> bool:
    """Whether an array is on a device that an installed PyTorch can use too."""
    if _in_memory(array) or importlib.util.find_spec("torch") is None:
        return False
    try:
        _as_tensor(array)
    except (AssertionError, BufferError, RuntimeError, TypeError):
        return False
    return True


def _as_tensor(array: Any) -> Any:
    import torch

    return torch.from_dlpack(array) if _is_foreign(array) else array


def _as_numpy(array: Any) -> Any:
    """The numbers in the CPU's memory; what is no array of another library as it is."""
    if not _is_foreign(array):
        return array
    if _in_memory(array):
        return np.from_dlpack(array)
    try:
        return np.from_dlpack(array, device="cpu")
    except (TypeError, BufferError, RuntimeError):  # older ones copy by a method of their own
        if hasattr(array, "get"):
            return np.asarray(array.get())
        if _torch_takes(array):
            return _as_tensor(array).cpu().numpy()
    library = type(array).__module__.partition(".")[0]
    raise TypeError(f"an array of {library} is on a device; copy it to the CPU, or install PyTorch")


def _returned(found: Any, like: Any) -> Any:
    """A result as an array of the library that was given, on its device; NumPy's if that has no
    way to make one.
    """
    library = _library(like)
    if isinstance(found, np.ndarray):
        if not hasattr(library, "asarray"):
            return found
        device = {} if _in_memory(like) else {"device": getattr(like, "device", None)}
        try:
            return library.asarray(found, **device)
        except TypeError:  # knows no devices
            return library.asarray(found)
    return library.from_dlpack(found) if hasattr(library, "from_dlpack") else found


def _library(array: Any) -> Any:
    if hasattr(array, "__array_namespace__"):
        return array.__array_namespace__()
    return sys.modules.get(type(array).__module__.partition(".")[0])
