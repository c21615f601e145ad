"""The fit kernel of the viewer's page, compiled natively: without AVX, four lanes as there."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Weights, aligned_zeros
from nacre.neural.samples import BLOCK, Samples
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer

FOLDER = Path(__file__).resolve().parents[2] / "src" / "nacre" / "viewer" / "kernel"
OPTIONS = ("-O3", "-std=gnu11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
_DOUBLES = {"network_loss", "samples_axis"}  # functions that return one


def missing() -> str | None:
    """What is not installed, if anything."""
    return None if shutil.which("gcc") else "gcc"


@cache
def library() -> ctypes.CDLL:
    """The compiled kernel; kept as long as this process lives."""
    folder = tempfile.TemporaryDirectory()
    path = Path(folder.name) / "kernel.so"
    sources = map(str, sorted(FOLDER.glob("*.c")))
    plain = ("-mno-avx",) if _has_avx() else ()
    command = ("gcc", *OPTIONS, *plain, "-shared", "-fPIC", *sources, "-o", str(path), "-lm")
    subprocess.run(command, check=True)
    found = ctypes.CDLL(str(path))
    folder.cleanup()  # the loaded library stays
    return found


def _has_avx() -> bool:
    made = subprocess.run(["gcc", "-dumpmachine"], capture_output=True, text=True, check=True)
    return made.stdout.startswith(("x86_64", "i686"))


def call(name: str, *arguments: Any) -> Any:
    """Call a function of the kernel with whole numbers, floats and contiguous arrays."""
    function = getattr(library(), name)
    function.restype = ctypes.c_double if name in _DOUBLES else ctypes.c_int
    return function(*map(_given, arguments))


def _given(argument: Any) -> Any:
    if isinstance(argument, np.ndarray):
        assert argument.flags.c_contiguous
        return ctypes.c_void_p(argument.ctypes.data)
    if isinstance(argument, float):
        return ctypes.c_double(argument)
    return argument if isinstance(argument, ctypes.c_float) else ctypes.c_int(argument)


def random(*seed: int) -> npt.NDArray[np.uint64]:
    """A generator's state, as of `np.random.default_rng(seed)`."""
    state = np.zeros(6, np.uint64)
    call("random_seed", state, np.array(seed, np.uint32), len(seed))
    return state


class NativeTrainer:
    """What :class:`nacre.neural.kernel.KernelTrainer` is, on the page's kernel."""

    def __init__(
        self, layers: Sequence[Layer], batch: int, activation: str = RELU, offset: float = 1.0
    ) -> None:
        assert offset == 1.0
        self._layers, self._batch, self._activation = list(layers), batch, activation
        self._sizes = np.array([len(layers[0].weights), *(len(x.biases) for x in layers)], np.int32)
        count = len(layers)
        bytes_ = call("network_bytes", self._sizes, count)
        self._net = aligned_zeros(bytes_ // 4)
        squared = int(activation == SQUARED_RELU)
        call("network_new", self._net, self._sizes, count, squared)
        flat = np.concatenate([part.ravel() for layer in layers for part in layer])
        call("network_list", self._net, flat.astype(np.float32), 1, 0)
        function = library().network_state
        function.restype = ctypes.c_void_p
        size = 3 * call("network_size", self._net)
        pointer = function(_given(self._net))
        self._state = np.ctypeslib.as_array(
            ctypes.cast(pointer, ctypes.POINTER(ctypes.c_float)), (size,)
        )
        self.steps = 0

    def _listed(self, gradient: bool) -> list[Layer]:
        flat = np.zeros(sum(layer.weights.size + layer.biases.size for layer in self._layers))
        flat = flat.astype(np.float32)
        call("network_list", self._net, flat, 0, int(gradient))
        found, start = [], 0
        for layer in self._layers:
            parts = []
            for part in layer:
                parts.append(flat[start : start + part.size].reshape(part.shape).copy())
                start += part.size
            found.append(Layer(*parts))
        return found

    def layers(self) -> list[Layer]:
        return self._listed(False)

    def copy(self) -> NativeTrainer:
        made = NativeTrainer(self.layers(), self._batch, self._activation)
        made.follow(self, self.steps)
        return made

    def follow(self, other: NativeTrainer, steps: int) -> None:
        self._state[:] = other._state
        self.steps = steps

    def average(self, other: NativeTrainer) -> None:
        self._state += other._state
        self._state *= np.float32(0.5)

    def gradient(self, samples: Samples, order: npt.NDArray[np.int64]) -> list[Layer]:
        """Gradient of the mean loss over the blocks in an order."""
        order = order.astype(np.int32)
        call("network_gradient", self._net, samples.blocks, order, len(order))
        return self._listed(True)

    def epoch(self, samples: Samples, order: npt.NDArray[np.int64], rates: Weights) -> None:
        blocks = order.astype(np.int32)
        rates = np.ascontiguousarray(rates, np.float32)
        counts = len(blocks), self._batch // BLOCK
        call(
            "network_train",
            self._net,
            samples.blocks,
            blocks,
            *counts,
            rates,
            len(rates),
            self.steps,
        )
        self.steps += len(rates)

    def loss(self, samples: Samples) -> float:
        return float(call("network_loss", self._net, samples.blocks, 0, samples.block_count))
