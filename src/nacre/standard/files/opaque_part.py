"""The opaque part of surfaces that do more than reflect: transmit, scatter inside, emit, vary."""

from __future__ import annotations

from nacre.errors import FormatError


class OpaquePart:
    """Refuses what no reflectance of one value has, or leaves it out and says so.

    Parameters
    ----------
    asked
        Whether it is left out.
    """

    def __init__(self, asked: bool) -> None:
        self._asked = asked
        self.notes: list[str] = []
        """A sentence for everything that was left out."""

    def without(self, problem: str, fix: str, left_out: str) -> None:
        """Leave something out; the words are a clause, an order and a sentence.

        Raises FormatError if that was not asked for.
        """
        if not self._asked:
            raise FormatError(f"{problem}; {fix}, or read the opaque part with --opaque-part")
        if left_out not in self.notes:
            self.notes.append(left_out)

    def share(self, name: str, value: float, effect: str, how: str) -> float:
        """What a weight in [0, 1] of an effect leaves of a surface, in [0, 1].

        Raises FormatError if the weight is out of bounds, or is not 0 and that is refused.
        """
        if not 0.0 <= value <= 1.0:
            raise FormatError(f"{name} must lie in [0, 1], got {value:g}")
        if value:
            self.without(
                f"{name} is {value:g}: {effect} is not read",
                "set it to 0",
                f"{effect.capitalize()} is {how} ({name} is {value:g}).",
            )
        return 1.0 - value
