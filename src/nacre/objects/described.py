"""How materials show themselves, in a line and in a notebook."""

from __future__ import annotations

import abc
import html
import textwrap
from collections.abc import Callable
from typing import Any

from nacre.errors import printable
from nacre.objects.frozen import Frozen

_drawers: list[Callable[[object], str]] = []
"""Functions that draw materials for notebooks; the last one is used."""


def draw_by(picture: Callable[[object], str]) -> None:
    """Have notebooks show what a function makes of a material: HTML, "" where there is no picture.

    What draws stands on materials, and registers itself here.
    """
    _drawers.append(picture)


class Described(Frozen):
    """A frozen object with a name that can describe itself."""

    name: str = ""
    """Name of the material, for people."""

    @abc.abstractmethod
    def describe(self) -> dict[str, Any]:
        """Facts in the order they should be shown."""

    def summary(self) -> str:
        """What this is, in a few words that are quick to compute."""
        return ""

    def __repr__(self) -> str:
        summary = textwrap.shorten(self.summary(), 140, placeholder=" ...")
        about = f": {summary}" if summary else ""
        return printable(f"<{type(self).__name__} {self.name!r}{about}>")

    def _repr_html_(self) -> str:
        """A picture where there is one, and the facts as a table, for notebooks."""
        rows = (
            f"<tr><th>{html.escape(key)}</th><td>{html.escape(str(value))}</td></tr>"
            for key, value in self.describe().items()
        )
        picture = _drawers[-1](self) if _drawers else ""
        return f"{picture}<table>{''.join(rows)}</table>"


def readable_size(size: int) -> str:
    """Bytes with a unit: 2700 are "2.7 kB"."""
    amount = float(size)
    for unit in ("bytes", "kB", "MB"):
        if amount < 1000.0:
            return f"{amount:.3g} {unit}"
        amount /= 1000.0
    return f"{amount:.3g} GB"
