"""Domes by name, and lists of directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.measured.textures import UTIA
from nacre.measured.textures.direction_list import named_directions


def test_domes_by_name() -> None:
    for name in ("utia", "UTIA"):
        for found, expected in zip(named_directions(name), UTIA.pairs(), strict=True):
            assert np.array_equal(found, expected)
    assert len(named_directions("Bonn")[0]) == 151**2


def test_directions_each_serve_as_light_and_view(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text("theta,phi\n0,0\n45,90\n\n")
    wi, wo = named_directions(str(path))
    tilted = [0.0, np.sqrt(0.5), np.sqrt(0.5)]
    assert wi == pytest.approx(np.array([[0, 0, 1], tilted] * 2), abs=1e-6)
    assert wo == pytest.approx(np.array([[0, 0, 1]] * 2 + [tilted] * 2), abs=1e-6)


def test_pairs_are_taken_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text("theta_l, phi_l, theta_v, phi_v\n90e-1,0,60,180\n")
    wi, wo = named_directions(str(path))
    assert wi == pytest.approx(np.array([[np.sin(np.pi / 20), 0, np.cos(np.pi / 20)]]), abs=1e-6)
    assert wo == pytest.approx(np.array([[-np.sqrt(0.75), 0, 0.5]]), abs=1e-6)


def test_vectors_are_pairs_too(tmp_path: Path) -> None:
    """As are lists of photographs; the limit of the angle is of all."""
    path = tmp_path / "list.csv"
    path.write_text("vx;vy;vz;lx;ly;lz\n0;0.6;0.8;0;0;1\n# last\n0;0;1;0.995;0;0.0999\n")
    wi, wo = named_directions(str(path))
    assert wi == pytest.approx(np.array([[0, 0, 1], [0.995, 0, 0.0999]]), abs=1e-4)
    assert wo == pytest.approx(np.array([[0, 0.6, 0.8], [0, 0, 1]]), abs=1e-6)
    with pytest.raises(FormatError, match="line 4: a polar angle is above 80 degrees"):
        named_directions(str(path), 80.0)
    path.write_text("file,theta_l,phi_l,theta_v,phi_v,quantity\na.png,80,0,30,9,radiance\n")
    assert len(named_directions(str(path), 80.0)[0]) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"0,0\n", "column '0' is not one of theta_l"),
        (b"theta,phi\n", "lists no directions"),
        (b"theta,phi\n1,2,3\n", "line 2"),
        (b"theta,phi\n1,2\n1,x\n", "line 3"),
        (b"theta,phi\n1,nan\n", "line 2"),
        (b"theta,phi\n0,0\n90,0\n", "line 3: column theta: 90 is not from 0 to below 90"),
        (b"theta,phi\n-9,0\n", "line 2: column theta: -9 is not from 0 to below 90"),
        (b"theta,phi\n89.1,0\n", "line 2: a polar angle is above 89"),
        (b"theta,phi\n5,0\n9,1\n5,360\n", "line 2 and line 4 have the same"),
        (b"theta,phi,lx\n5,0,1\n", "'lx' is not one of theta, phi"),
        (b"theta,phi\n" + b"1,1\n" * 513, "263169 pairs"),
        (b"theta,phi\n\xff", "line 2: 1 values, not 2"),
        (b"", "empty"),
    ],
)
def test_what_is_no_list_is_named(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "list.csv"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=message) as error:
        named_directions(str(path), 89.0)
    assert "\n" not in str(error.value)


def test_no_dome_of_that_name() -> None:
    with pytest.raises(FormatError, match=r"bonn, utia"):
        named_directions("berlin")
