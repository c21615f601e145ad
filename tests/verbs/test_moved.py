"""Names of 0.2 in `nacre.render` and `nacre.export`, which are verbs now."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest

import nacre
from nacre.verbs import exporting, rendering

WORKS = {
    "attribute": ("import nacre; nacre.render.register()", "nacre.mitsuba.register"),
    "from": ("from nacre.render import register; register()", "nacre.mitsuba.register"),
    "module": ("import nacre.export; nacre.export.TARGETS['glsl']", "nacre.targets.TARGETS"),
    "class": ("from nacre.export import Target; class_ = Target", "nacre.targets.Target"),
    "function": ("import nacre; nacre.export.export", "nacre.targets.export"),
    "as": ("import nacre.render as r; r.render_file", "nacre.mitsuba.render_file"),
    "module below": ("from nacre.export.source import Language", "nacre.targets.source"),
    "module below, imported": ("import nacre.render.sphere", "nacre.mitsuba.sphere"),
    "module below, attribute": ("import nacre; nacre.render.sphere", "nacre.mitsuba.sphere"),
    "after the verb": (
        "import nacre; nacre.export; from nacre.export import program",
        "nacre.targets.program",
    ),
    "far below": (
        "from nacre.render.textures.scene import GEOMETRIES",
        "nacre.mitsuba.textures.scene",
    ),
}


def run(code: str, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *options, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("spelling", WORKS)
def test_old_names_work_and_say_the_new_one(spelling: str) -> None:
    code, new = WORKS[spelling]
    done = run(f"{code}\nimport nacre\nassert callable(nacre.render) and callable(nacre.export)")
    assert done.returncode == 0, done.stderr
    # Shown, as the line itself is the program's.
    assert f"DeprecationWarning: nacre.{code.split('nacre.')[1].split()[0][:6]}" in done.stderr
    assert f"is now {new}" in done.stderr
    refused = run(code, "-W", "error::DeprecationWarning:__main__")
    assert refused.returncode == 1


def test_what_is_there_under_an_old_name_is_the_same() -> None:
    code = """
import warnings
warnings.simplefilter("ignore")
from nacre.export.source import Language
from nacre.render import bsdf
import nacre, nacre.mitsuba, nacre.targets.source
assert Language is nacre.targets.source.Language and bsdf is nacre.mitsuba.bsdf
assert nacre.targets.source.__name__ == nacre.targets.source.__spec__.name == "nacre.targets.source"
"""
    done = run(code)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import nacre; nacre.render.nothing", "nacre.render is a function and has no 'nothing'"),
        ("import nacre.export.nothing", "No module named 'nacre.export.nothing'"),
    ],
)
def test_names_that_never_were_there_are_refused(code: str, words: str) -> None:
    assert words in run(code).stderr


def test_the_verbs_show_what_they_take() -> None:
    for verb, function in ((nacre.render, rendering.render), (nacre.export, exporting.export)):
        assert inspect.signature(verb) == inspect.signature(function)
        assert inspect.getdoc(verb) == inspect.getdoc(function)
    assert repr(nacre.render) == "<function nacre.render>"
