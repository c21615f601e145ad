"""Samples on PyTorch devices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.errors import require
from nacre.neural.samples import BLOCK, Samples
from nacre.runtime.device import open_device

torch: Any = require("torch", "torch")


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
