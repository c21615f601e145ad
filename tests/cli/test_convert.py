"""`nacre convert` and spectra: they are kept, or a note says that they are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from tests.measured.support import BANDS, material, spectral, tensor_bytes, write
from tests.tiers import tiered


@pytest.mark.parametrize(
    ("target", "kept"),
    tiered(
        [("a.csv", True), ("a.bsdf", True), ("a.binary", False), ("a.npz", False)],
        [("a.csv", True), ("a.npz", False)],
    ),
)
def test_wavelengths_are_kept_or_missed_aloud(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], target: str, kept: bool
) -> None:
    source = write(tmp_path / "made_spec.bsdf", tensor_bytes(spectral(material([0.0]))))
    main(["convert", str(source), "-o", str(tmp_path / target)])
    assert ("not its wavelengths" in capsys.readouterr().err) == (not kept)
    back = nacre.load(tmp_path / target)
    if kept:
        np.testing.assert_array_equal(back.wavelengths, BANDS)
    else:
        assert back.wavelengths is None


def test_samples_become_a_table_of_colors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write(tmp_path / "made_spec.bsdf", tensor_bytes(spectral(material([0.0]))))
    nacre.save(nacre.load(source), tmp_path / "a.csv")
    main(["convert", str(tmp_path / "a.csv"), "-o", str(tmp_path / "a.bsdf")])
    assert "not its wavelengths" in capsys.readouterr().err
