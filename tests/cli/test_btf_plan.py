"""`nacre btf plan`, and photographs of its directions encoded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.measured.textures.direction_list import named_directions, read_rows
from nacre.textures.codecs import save_codec
from tests.cli.support import assert_refused, run
from tests.textures.codecs.basis.made import codec
from tests.textures.support import linear, write_image

MODEL = "--codec", "model.safetensors"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_codec(codec(), "model.safetensors")
    (tmp_path / "photos").mkdir()
    return tmp_path


def test_photographs_of_a_plan_are_encoded(here, capsys) -> None:
    pytest.importorskip("PIL", reason="needs the extra 'render'")
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    assert (
        run(
            "btf",
            "plan",
            "--count",
            12,
            "-o",
            "d.csv",
            *MODEL,
            "--max-light-angle",
            60,
            "--max-view-angle",
            50,
        )
        == 0
    )
    assert "d.csv: 12 pairs" in capsys.readouterr().out
    wi, wo = named_directions("d.csv")
    assert wi[:, 2].min() > np.cos(np.radians(60.1))
    assert wo[:, 2].min() > np.cos(np.radians(50.1))
    images = np.random.default_rng(0).integers(20, 250, (12, 5, 7, 3), np.uint8)
    for (_, row), image in zip(read_rows("d.csv"), images, strict=True):
        write_image(Path("photos", row["file"]), image)
    encode = "fit", "photos", "-o", "c.safetensors", *MODEL
    assert run(*encode, "--directions", "d.csv") == 0
    found = nacre.load("c.safetensors")
    values = np.stack([linear(image) for image in images], axis=2).reshape(35, 12, 3)
    expected = codec().encoder(wi, wo)(values)
    np.testing.assert_allclose(found.latent.codes.reshape(35, 2), expected, rtol=1e-3, atol=1e-3)
    assert found.name == "photos"
    Path("d.csv").rename("photos/directions.csv")
    assert run(*encode[:3], "again.safetensors", *MODEL) == 0
    again = nacre.load("again.safetensors")
    assert np.array_equal(again.latent.codes, found.latent.codes)


def test_the_first_half_of_a_plan_is_a_plan(here) -> None:
    assert run("btf", "plan", "--count", 10, "-o", "ten.csv", *MODEL, "--flash") == 0
    assert run("btf", "plan", "--count", 5, "-o", "five.csv", *MODEL, "--flash") == 0
    ten, five = (Path(f"{n}.csv").read_text().splitlines() for n in ("ten", "five"))
    assert ten[2:8] == five[2:]  # without the lines that say what they are and who wrote them
    wi, wo = named_directions("ten.csv")
    assert np.array_equal(wi, wo)
    rehearsal = "btf", "capture", "fabric01", "--texels", 4, "--paths", 1, "-o", "rehearsal.npz"
    assert run(*rehearsal, "--directions", "five.csv") == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("btf plan --count 5 -o x.txt", "a list of directions is a .csv file"),
        ("btf plan --count 0 -o x.csv", "--count: expected 1 to 4,096, got 0"),
        (
            "btf plan --count 5 -o x.csv --max-light-angle 90",
            "--max-light-angle: expected above 0, up to 89, got 90",
        ),
        ("btf plan --count 5 -o x.csv --codec one.csv", "one.csv: no such file"),
        (
            "fit model.safetensors -o c.safetensors --directions one.csv",
            "for folders of images",
        ),
        ("fit photos -o c.safetensors --directions one.csv", "one.csv: no such file"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(here, capsys, arguments, words) -> None:
    assert_refused(capsys, words, *arguments.split())
