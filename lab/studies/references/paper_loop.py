"""The training loop of the NBRDF paper in plain PyTorch, to compare with.

Settings of the published code: 6-21-21-3 with uniform(-0.05, 0.05) weights, ReLU on exp(x) - 1,
batch 512, Adam with a constant 5e-4, samples shuffled every epoch, the loss read every step. Run as
a process of its own: `python -m lab.studies.references.paper_loop SAMPLES.npz`. For every line
with a number of epochs it answers with a line of JSON: seconds of training, held-out loss after it.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np
import torch

BATCH = 512
LEARNING_RATE = 5e-4


class Network(torch.nn.Module):
    """6-21-21-3 with the published initialization."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = torch.nn.ModuleList(
            torch.nn.Linear(a, b) for a, b in ((6, 21), (21, 21), (21, 3))
        )
        for layer in self.layers:
            torch.nn.init.uniform_(layer.weight, -0.05, 0.05)
            torch.nn.init.zeros_(layer.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Reflectance of network inputs (n, 6)."""
        x = torch.relu(self.layers[0](x))
        x = torch.relu(self.layers[1](x))
        return torch.relu(torch.exp(self.layers[2](x)) - 1.0)


def loss_of(network: Network, rows: torch.Tensor) -> torch.Tensor:
    """Mean log-cosine loss of rows (inputs, log(1 + f cos), cos)."""
    predicted = network(rows[:, :6])
    return (torch.log(1.0 + predicted * rows[:, 9:]) - rows[:, 6:9]).abs().mean()


def train_epoch(
    network: Network, optimizer: torch.optim.Optimizer, training: torch.Tensor
) -> list[float]:
    """The losses of an epoch of steps."""
    shuffled = training[torch.randperm(len(training))]
    losses = []
    for first in range(0, len(shuffled) - BATCH + 1, BATCH):
        optimizer.zero_grad()
        loss = loss_of(network, shuffled[first : first + BATCH])
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    return losses


def main() -> None:
    """Train as many epochs at a time as the lines of the standard input say."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    data = np.load(sys.argv[1])
    training, held_out = (torch.from_numpy(data[name]) for name in ("training", "held_out"))
    network = Network()
    optimizer = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    for line in sys.stdin:
        start = time.perf_counter()
        for _ in range(int(line)):
            train_epoch(network, optimizer, training)
        seconds = time.perf_counter() - start
        with torch.no_grad():
            loss = float(loss_of(network, held_out))
        print(json.dumps({"seconds": seconds, "held_out_loss": loss}), flush=True)


if __name__ == "__main__":
    main()
