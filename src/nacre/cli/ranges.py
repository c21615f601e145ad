"""Numbers that options take."""

from __future__ import annotations

import math
from typing import Any

import click

SEED = click.IntRange(0, (1 << 32) - 1)
"""Of random numbers: of the libraries that draw them, some take 32 bits."""


class FiniteRange(click.FloatRange):
    """Numbers in a range that are finite: to click "nan" lies within all, "inf" in open ones."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """See click."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number
