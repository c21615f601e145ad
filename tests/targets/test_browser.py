"""Runners in a browser: what they say of exports that do not compile."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.oracles.runners import browser, three
from tests.targets.support import needs, runner

UP = np.float32([[0.0, 0.0, 1.0]])
WRONG = {
    "webgl": {"m.glsl": b"vec3 m_eval(vec3 wi, vec3 wo) { return wi * nothing; }"},
    "webgpu": {"m.wgsl": b"fn m_eval(wi: vec3f, wo: vec3f) -> vec3f { return wi * nothing; }"},
    "three-webgl": {
        "m.js": b"""export const name = "m";
        export const glsl = "vec3 m_eval(vec3 wi, vec3 wo) { return wi * nothing; }";"""
    },
    "three-webgpu": {
        "m.js": b"""export const name = "m";
        export const wgsl = "fn m_eval(wi: vec3f, wo: vec3f) -> vec3f { return wi * nothing; }";"""
    },
}


@pytest.mark.parametrize("name", WRONG)
def test_what_does_not_compile_is_refused_with_the_words_of_the_compiler(name: str) -> None:
    with pytest.raises(RuntimeError, match="nothing"):
        runner(name).run(WRONG[name], "m", "eval", UP, UP)


def test_coarse_numbers_are_refused() -> None:
    source = b"mediump vec3 m_eval(vec3 wi, vec3 wo) { return wi; }"
    with pytest.raises(RuntimeError, match="mediump"):
        runner("webgl").run({"m.glsl": source}, "m", "eval", UP, UP)


def test_pages_reach_no_network() -> None:
    needs(browser.missing())
    script = b"export const run = async () => (await fetch('https://example.org/')).status;"
    with pytest.raises(RuntimeError, match="404"):
        browser.compute({"main.js": script}, "main.js", "run")


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert re.search("chromium|playwright", str(browser.missing()))
    assert browser.missing() == three.missing()
