"""Files made to harm: each is refused in one line with exit code 2, in little memory and time."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import nacre
from nacre.analytic import Ggx
from tests.attacks.files import ATTACKS
from tests.variants import require_mitsuba

ROOT = Path(__file__).parents[2]
SECONDS = 5.0
"""Of processor time, for one attack."""
MEBIBYTES = 100.0
"""That a process may grow by; every bomb would take more, most of them more than there is."""
GOOD = Ggx(diffuse=(0.2, 0.1, 0.1), specular=(0.3, 0.2, 0.1), roughness=0.3)


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What came of each attack, all tried in one process, and what then lies in the folder."""
    require_mitsuba()
    folder = tmp_path_factory.mktemp("attacks")
    nacre.save(GOOD, folder / "paint.json")
    (folder / "empty.xml").write_text('<scene version="3.0.0"/>')
    whole = [["info", "paint.json"], ["render", "empty.xml", "-o", "out.exr"]]
    whole += [["view", "paint.json", "--environment", "none.png", "-o", "out.html"]]
    commands = {}
    for name, attack in ATTACKS.items():
        (first, last), path = attack.command, attack.write(folder / name)
        commands[name] = [*first, str(path.relative_to(folder)), *last]
    done = subprocess.run(
        [sys.executable, "-m", "tests.attacks.trial"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        input=json.dumps([whole, commands]),
        capture_output=True,
        text=True,
        timeout=300,
    )
    found = {one["name"]: one for one in map(json.loads, done.stdout.splitlines())}
    assert done.returncode == 0, f"ended after {list(found)[-1:]}: {done.stderr[-500:]}"
    assert not list(folder.glob("out.*")), "something was written"
    return found


@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_is_refused_in_one_line(name: str, outcomes: dict[str, dict[str, Any]]) -> None:
    found, attack = outcomes[name], ATTACKS[name]
    assert found["code"] == 2, found
    lines = found["err"].splitlines()
    assert len(lines) == 1, found["err"]
    assert lines[0].isprintable()
    assert found["out"] == ""  # a pickle that ran would print
    assert re.search(attack.says, lines[0]), lines[0]
    assert "owned" not in found["out"] + found["err"].replace("]0;owned", "")
    assert "root:" not in found["out"] + found["err"]
    assert found["seconds"] < SECONDS
    assert found["grown"] < MEBIBYTES


def test_attacks_are_small_and_distinct() -> None:
    contents = [tuple(attack.files().values()) for attack in ATTACKS.values()]
    assert len(set(contents)) == len(contents) >= 20
    assert all(len(part) < 1 << 18 for content in contents for part in content)
