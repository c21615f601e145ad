"""Light for tests."""

import numpy as np

from nacre.mitsuba.environment import Environment


def lamps() -> Environment:
    """A dim sky with two lamps, one of them at the pole."""
    pixels = np.full((16, 32, 3), 0.1, np.float32)
    pixels[4:6, 20:22] = 50.0, 40.0, 30.0
    pixels[0] = 8.0
    return Environment(pixels)
