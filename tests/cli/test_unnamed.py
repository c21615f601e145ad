"""`nacre FILE`: every kind of file is named, and every line to type is a command that takes it."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import click
import pytest

from nacre.cli import root
from nacre.included import resolve
from tests.cli.support import assert_refused, run
from tests.specimens import SPECIMENS


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, kind in {
        "paint.bsdf": "RGL",
        "weave.npz": "NumPy archive of a BTF",
        "codes.safetensors": "nacre encoded texture",
    }.items():
        Path(name).write_bytes(SPECIMENS[kind].files()[0])
    shutil.copy(resolve("rgl:paper_white"), "paint.safetensors")
    Path("room.xml").write_text("<scene version='3.0.0'/>")
    Path("lab").mkdir()
    shutil.copy("paint.bsdf", "lab/two words.bsdf")
    return tmp_path


@pytest.mark.parametrize(
    ("name", "about", "typed"),
    [
        ("paint.bsdf", "one material (RGL)", {"info", "fit", "render", "view"}),
        ("lab/two words.bsdf", "one material (RGL)", {"info", "fit", "render", "view"}),
        ("paint.safetensors", "one material", {"info", "render", "view", "export"}),
        ("rgl:paper_white", "one material", {"info", "render", "view", "export"}),
        ("weave.npz", "a texture", {"info", "fit", "render"}),
        ("codes.safetensors", "a texture", {"info", "render", "view", "btf"}),
        ("room.xml", "a Mitsuba scene", {"render"}),
        ("lab", "a folder with measured files", {"fit", "view"}),
    ],
)
def test_a_file_is_named_and_lines_to_type_are_commands(
    here: Path, capsys: pytest.CaptureFixture[str], name: str, about: str, typed: set[str]
) -> None:
    assert run(name) == 2
    first, *lines = capsys.readouterr().err.splitlines()
    assert first.startswith(f"nacre: {name}: is {about}")
    found = set()
    for line in lines:
        words = shlex.split(line.strip().partition("  ")[0])
        assert words[0] == "nacre"
        found.add(words[1])
        command: click.Command = root
        context = click.Context(root, info_name="nacre", **root.context_settings)
        rest = words[1:]
        while isinstance(command, click.Group):
            below = command.get_command(context, rest.pop(0))
            assert below is not None
            command = below
        assert name in rest
        command.make_context(command.name, rest, parent=context)  # raises for wrong usage
    assert found == typed


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("paint.bsd", "paint.bsd: no such file; did you mean paint.bsdf"),
        ("lab/x.bsdf", "lab/x.bsdf: no such file"),
        ("nowhere/x.bsdf", "nowhere/x.bsdf: no such file"),
        ("rgl:paper_whit", "did you mean rgl:paper_white"),
        ("notes.txt", "notes.txt: is of no known format"),
        ("encode", "did you mean nacre latent encode"),
    ],
)
def test_a_word_that_is_neither_file_nor_command_is_refused(
    here: Path, capsys: pytest.CaptureFixture[str], name: str, words: str
) -> None:
    Path("notes.txt").write_text("hello")
    assert_refused(capsys, words, name)


def test_files_of_ours_that_hold_no_material_are_named(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from nacre.textures.codecs.codec_file import PRETRAINED

    assert run(next(iter(PRETRAINED.values()))) == 2
    assert "is a texture codec; nacre fit encodes textures with it" in capsys.readouterr().err
