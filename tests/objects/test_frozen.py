"""Objects that do not change after they are made."""

import pickle
from dataclasses import dataclass
from functools import cached_property

import pytest

from nacre.objects.frozen import Frozen


class Table(Frozen):
    """A plain class."""

    kind = "table"

    def __init__(self, size: int) -> None:
        self.size = size

    @cached_property
    def squares(self) -> list[int]:
        """Computed when first asked for."""
        return [k * k for k in range(self.size)]


class Unusual(Table):
    """Its constructor calls no other."""

    def __init__(self) -> None:
        self.size = 2


@dataclass
class Fraction(Frozen):
    """A dataclass that checks itself."""

    value: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.value <= 1.0:
            raise ValueError("value must lie in [0, 1]")
        self.percent = 100.0 * self.value


@pytest.mark.parametrize("made", [Table(3), Unusual(), pickle.loads(pickle.dumps(Table(3)))])
def test_attributes_cannot_be_set_or_deleted(made):
    with pytest.raises(AttributeError, match=r"use replaced\(size=...\)"):
        made.size = 5
    with pytest.raises(AttributeError, match="does not change"):
        del made.size
    assert made.squares == [k * k for k in range(made.size)]


def test_a_copy_has_other_attributes_and_is_closed_too():
    made = Table(3)
    assert made.squares == [0, 1, 4]
    other = made.replaced(size=4, kind="list")
    assert (other.size, other.kind, made.size, made.kind) == (4, "list", 3, "table")
    assert other.squares is made.squares
    with pytest.raises(AttributeError, match="does not change"):
        other.size = 5
    with pytest.raises(AttributeError, match="has no attribute 'sise'"):
        made.replaced(sise=4)


def test_a_copy_does_not_compute_what_it_replaces():
    made = Table(3)
    assert made.replaced(squares=[7]).squares == [7]
    assert "squares" not in vars(made)


def test_a_dataclass_checks_what_is_replaced():
    made = Fraction(0.5)
    assert made.replaced(value=0.2).percent == 20.0
    with pytest.raises(ValueError, match="must lie"):
        made.replaced(value=2.0)
    with pytest.raises(AttributeError, match="does not change"):
        made.replaced(value=0.1).value = 3.0
