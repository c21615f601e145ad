"""Several processes that train one network, as `torchrun` starts them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from nacre.textures.codecs.networks.mlp import Tensor, torch


@dataclass(frozen=True)
class Processes:
    """One of the processes that train together: its number, and how many there are."""

    rank: int = 0
    size: int = 1

    def average_gradients(self, parameters: Sequence[Tensor]) -> None:
        """Replace gradients by their means over all processes, in one exchange."""
        if self.size == 1:
            return
        gradients = [p.grad for p in parameters]
        flat = torch.cat([g.flatten() for g in gradients])
        torch.distributed.all_reduce(flat)
        flat /= self.size
        parts = flat.split([g.numel() for g in gradients])
        for gradient, part in zip(gradients, parts, strict=True):
            gradient.copy_(part.view_as(gradient))

    def agree(self, number: float, device: Any) -> float:
        if self.size == 1:
            return number
        said = torch.tensor(number, dtype=torch.float64, device=device)
        torch.distributed.broadcast(said, 0)
        return float(said.item())


@contextmanager
def processes(device: str) -> Iterator[tuple[Processes, str]]:
    """Join those that `torchrun` has started; gives them, and the device of this one: "cuda"
    becomes one device per process.
    """
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        yield Processes(), device
        return
    if device == "cuda":
        device = f"cuda:{os.environ.get('LOCAL_RANK', '0')}"
    torch.distributed.init_process_group("nccl" if device.startswith("cuda") else "gloo")
    try:
        yield Processes(torch.distributed.get_rank(), size), device
    finally:
        torch.distributed.destroy_process_group()
