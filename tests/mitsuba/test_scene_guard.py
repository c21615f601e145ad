"""Scenes that nest too deeply, alone or by what they include; Mitsuba is the oracle of the rest."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.mitsuba.scene_file import load_scene
from nacre.mitsuba.scene_guard import MAX_DEPTH, check_scene


def scene(*parts: str) -> str:
    return f'<scene version="3.0.0">{"".join(parts)}</scene>'


def include(name: str) -> str:
    return f'<include filename="{name}"/>'


def nested(depth: int) -> str:
    return "<shape>" * depth + "</shape>" * depth


def write(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.xml").write_text(text)
    return folder / "a.xml"


@pytest.mark.parametrize("depth", [MAX_DEPTH, 100_000])
def test_deep_files_are_refused_before_mitsuba_reads_them(tmp_path: Path, depth: int) -> None:
    with pytest.raises(FormatError, match=r"a\.xml: line 1: <shape> lies within 64 others"):
        check_scene(write(tmp_path, a=scene(nested(depth))))
    check_scene(write(tmp_path, a=scene(nested(MAX_DEPTH - 1))))


def test_levels_add_up_over_files(tmp_path: Path) -> None:
    half = scene(nested(MAX_DEPTH // 2))
    check_scene(write(tmp_path, a=scene(include("b.xml")), b=half))
    twice = scene(nested(MAX_DEPTH // 2).replace("><", f">{include('b.xml')}<", 33))
    with pytest.raises(FormatError, match=r"lies within 64 others"):
        check_scene(write(tmp_path, a=twice, b=half))


@pytest.mark.parametrize(
    "parts",
    [
        (include("b.xml"),),
        ('<default name="which" value="b"/>', include("$which.xml")),
        ('<path value="other"/>', include("c.xml")),
    ],
)
def test_includes_are_followed_as_mitsuba_does(tmp_path: Path, parts: tuple[str, ...]) -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    (tmp_path / "other").mkdir()
    found = tmp_path / ("other/c.xml" if "path" in parts[0] else "b.xml")
    top = write(tmp_path, a=scene(*parts))
    found.write_text(scene('<shape type="sphere"/>'))
    assert len(load_scene(top).shapes()) == 1
    found.write_text(scene(nested(100_000)))
    with pytest.raises(FormatError, match=f"{found.name}: line 1: <shape> lies within"):
        load_scene(top)


def test_circles_and_unknown_names_are_refused(tmp_path: Path) -> None:
    circle = write(tmp_path, a=scene(include("b.xml")), b=scene(include("a.xml")))
    with pytest.raises(FormatError, match=r"a\.xml, which includes itself"):
        check_scene(circle)
    with pytest.raises(FormatError, match=r"\$which has no <default>"):
        check_scene(write(tmp_path, a=scene(include("$which.xml"))))


def test_names_may_not_grow_without_end(tmp_path: Path) -> None:
    names = [f"x{'y' * (99 - n)}" for n in range(100)]  # the longest is put in first
    doubling = [f'<default name="{a}" value="${b}${b}"/>' for a, b in itertools.pairwise(names)]
    with pytest.raises(FormatError, match="a name longer than 4096 letters"):
        check_scene(write(tmp_path, a=scene(*doubling, include(f"${names[0]}"))))
    with pytest.raises(FormatError, match="File name too long"):
        check_scene(write(tmp_path, a=scene(include("n" * 300))))


def test_what_is_included_again_and_again_is_counted(tmp_path: Path) -> None:
    files = {n: scene(include(f"{m}.xml") * 20) for n, m in zip("abcde", "bcdef", strict=True)}
    with pytest.raises(FormatError, match="makes more than 1,000,000 elements"):
        check_scene(write(tmp_path, **files, f=scene(nested(1))))


def test_mixtures_need_a_weight(tmp_path: Path) -> None:
    """Without, Mitsuba ends the process."""
    diffuse = '<bsdf type="diffuse"/>'
    weight = '<float name="weight" value="0.5"/>'
    inner = f'<bsdf type="blendbsdf">{weight}{diffuse}{diffuse}</bsdf>'
    check_scene(write(tmp_path, a=scene(inner)))
    outer = f'<bsdf type="blendbsdf">\n{inner}{diffuse}</bsdf>'
    with pytest.raises(FormatError, match=r"a\.xml: line 1: this blendbsdf has no weight"):
        check_scene(write(tmp_path, a=scene(outer)))
