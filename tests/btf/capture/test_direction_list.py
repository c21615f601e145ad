"""Lists of directions to capture at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.btf import UTIA
from nacre.btf.capture.direction_list import read_directions
from nacre.files import FormatError


def test_domes_by_name() -> None:
    for found, expected in zip(read_directions("utia"), UTIA.pairs(), strict=True):
        assert np.array_equal(found, expected)


def test_directions_each_serve_as_light_and_view(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text("theta,phi\n0,0\n45,90\n\n")
    wi, wo = read_directions(str(path))
    tilted = [0.0, np.sqrt(0.5), np.sqrt(0.5)]
    assert wi == pytest.approx(np.array([[0, 0, 1], tilted] * 2), abs=1e-6)
    assert wo == pytest.approx(np.array([[0, 0, 1]] * 2 + [tilted] * 2), abs=1e-6)


def test_pairs_are_taken_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text("theta_l, phi_l, theta_v, phi_v\n90e-1,0,60,180\n")
    wi, wo = read_directions(str(path))
    assert wi == pytest.approx(np.array([[np.sin(np.pi / 20), 0, np.cos(np.pi / 20)]]), abs=1e-6)
    assert wo == pytest.approx(np.array([[-np.sqrt(0.75), 0, 0.5]]), abs=1e-6)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"0,0\n", "line 1"),
        (b"theta,phi\n", "0 pairs"),
        (b"theta,phi\n1,2,3\n", "line 2"),
        (b"theta,phi\n1,2\n1,x\n", "line 3"),
        (b"theta,phi\n1,nan\n", "line 2"),
        (b"theta,phi\n90,0\n", "line 2"),
        (b"theta,phi\n-5,0\n", "line 2"),
        (b"theta,phi\n" + b"1,1\n" * 513, "263169 pairs"),
        (b"theta,phi\n\xff", "CSV"),
        (b"", "empty"),
    ],
)
def test_what_is_no_list_is_named(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "list.csv"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=message) as error:
        read_directions(str(path))
    assert "\n" not in str(error.value)


def test_no_dome_of_that_name() -> None:
    with pytest.raises(FormatError, match=r"bonn, utia"):
        read_directions("berlin")
