"""Damaged files of what is no material: scenes, light, pictures, states, lists, bases and codes."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from tests.fuzz.readers import readers
from tests.fuzz.target import target
from tests.specimens import mutated
from tests.variants import require_mitsuba

require_mitsuba()
pytest.importorskip("torch", reason="some states are of PyTorch")
DAMAGED = 2


@pytest.mark.parametrize("name", readers())
def test_whole_files_are_read_and_damage_is_refused(name: str, tmp_path: Path) -> None:
    entry, random = readers()[name], Random(2)
    with target(entry, entry.specimen, tmp_path) as test:
        for content in entry.specimen.files():
            assert test.check(content)
        for _ in range(DAMAGED):
            content = random.choice(entry.specimen.files())
            test.check(mutated(content, random))
            test.check(entry.specimen.rebuild(content, random))
