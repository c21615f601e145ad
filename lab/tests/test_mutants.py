"""Mutants of a module: where they are made, and where they are not."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

from lab.studies.mutants.operators import mutants

SOURCE = '''"""Words."""

from __future__ import annotations

__all__ = ["area"]
_SIZE_LIMIT = 1 << 20
EDGE: Literal["long"] = "short"


def area(width: float, height: float = 2.0, name: Literal["a"] = "b") -> float:
    """Words, 1 and 2."""
    if width < 0.0 or not name:
        where = f"{name}: {width + 1}"
        raise ValueError(f"{where} is below " + "0")
    return width * height
'''


def found(tmp_path: Path, source: str) -> list[tuple[str, str]]:
    """Operators, and the line of each mutant."""
    (tmp_path / "a.py").write_text(source)
    pairs = []
    for mutant in mutants("a.py", tmp_path):
        changed = mutant.applied(source)
        ast.parse(changed)
        assert changed.count("\n") == source.count("\n")
        different = set(changed.splitlines()) - set(source.splitlines())
        pairs.append((mutant.operator, min(different, default="").strip()))
    return pairs


def test_what_matters_is_changed_and_words_are_not(tmp_path: Path) -> None:
    pairs = found(tmp_path, SOURCE)
    assert Counter(operator for operator, _ in pairs) == {
        **{"text": 2, "constant": 2, "comparison": 1, "boolean": 2},
        **{"raise": 1, "arithmetic": 1, "return": 1},
    }
    lines = {line for _, line in pairs}
    assert "if (width <= 0.0) or not name:" in lines
    assert "return (width / height)" in lines
    assert "EDGE: Literal[\"long\"] = 'XXshortXX'" in lines


def test_a_mutant_of_several_lines_keeps_their_number(tmp_path: Path) -> None:
    source = "x = f(\n    1,\n    (2\n     + 3),\n)\nx.append(\n    4\n)\n"
    operators = Counter(operator for operator, _ in found(tmp_path, source))
    assert operators == {"constant": 4, "arithmetic": 1, "statement": 1}
