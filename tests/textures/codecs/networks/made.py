"""Small textures that look like something."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nacre.btf import TableBtf
from nacre.errors import FormatError
from nacre.measured.textures import BONN, UTIA
from nacre.measured.textures.domes import below, pairs

COARSE = pairs(*[BONN.directions[below(BONN.directions, 40.0)][::3]] * 2)
"""15 directions for light and viewer each: 225 pairs."""
OTHER = pairs(*[UTIA.directions[below(UTIA.directions, 40.0)][::2]] * 2)
"""10 directions for light and viewer each: 100 pairs."""


def texture(seed: int, size: int = 6, directions: Any = COARSE) -> TableBtf:
    """Diffuse color and a glossy lobe that change from texel to texel."""
    random = np.random.default_rng(seed)
    wi, wo = directions
    half = wi + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shape = (size, size, 1, 1)
    color = random.uniform(0.05, 0.8, 3) * random.uniform(0.5, 1.0, shape)
    lobe = half[:, 2:] ** random.uniform(5.0, 60.0, shape) * random.uniform(0.0, 1.0, shape)
    return TableBtf((color + lobe).astype(np.float32), wi, wo, f"made {seed}")


def write(folder: Path, count: int, size: int = 6, directions: Any = COARSE) -> list[Path]:
    """Files of textures that :func:`load` reads."""
    paths = []
    for seed in range(count):
        made = texture(seed, size, directions)
        paths.append(folder / f"{seed}.npz")
        np.savez(paths[-1], values=made.values, wi=made.wi, wo=made.wo, name=made.name)
    return paths


def load(path: Any) -> TableBtf:
    """A texture of :func:`write`."""
    try:
        with np.load(path) as file:
            return TableBtf(file["values"], file["wi"], file["wo"], str(file["name"]))
    except (OSError, ValueError, KeyError) as error:
        raise FormatError(f"{path}: is no texture") from error
