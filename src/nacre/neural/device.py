"""PyTorch devices, and samples on them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from nacre.files import NacreError, reason, require
from nacre.neural.samples import BLOCK, Samples

torch: Any = require("torch", "latent")


def open_device(device: str) -> Any:
    """The PyTorch device of a name: "cpu", "cuda", "cuda:1".

    Raises
    ------
    NacreError
        If PyTorch has no such device here.
    """
    try:
        opened = torch.device(device)
        float(torch.bmm(*torch.ones((2, 1, 1, 1), device=opened)))
    except Exception as error:  # devices fail in ways of their own
        raise NacreError(f"device {device!r} cannot be used: {reason(error)}") from error
    return opened


@contextmanager
def memory_errors(device: str) -> Iterator[None]:
    """A block in which memory that runs out is an error of one line."""
    try:
        yield
    except torch.OutOfMemoryError as error:
        raise NacreError(f"device {device!r}: {reason(error)}") from error


def stack_bytes(device: str) -> int:
    """Bytes of samples that make a full stack: 1 GiB, of CUDA 4 GiB or half of what is free."""
    opened = open_device(device)
    if opened.type != "cuda":
        return 1 << 30
    free, _ = torch.cuda.mem_get_info(opened)
    return min(4 << 30, int(free) // 2)


class SampleStack:
    """Samples of several materials on a device.

    Parameters
    ----------
    samples
        Of each material; all have the same inputs.
    device
        PyTorch device.
    """

    def __init__(self, samples: Sequence[Samples], device: str) -> None:
        counts = [part.block_count for part in samples]
        rows = samples[0].rows
        # Sample by sample, so that a batch that is gathered is a matrix with a sample a row.
        self.blocks = torch.empty((sum(counts), BLOCK, rows), device=device)
        self.parts = self.blocks.split(counts)
        for target, part in zip(self.parts, samples, strict=True):
            source = torch.from_numpy(part.blocks).view(-1, rows, BLOCK)
            target.copy_(source.to(device).transpose(1, 2))
        starts = np.cumsum([0, *counts[:-1]])[:, None]
        self.starts = torch.from_numpy(starts).to(device)
        self.block_count = min(counts)
        """Blocks that every material has."""
