"""Write the tables of soundness into their page: `python -m tests.soundness`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from nacre.errors import NacreError
from nacre.soundness import PROPERTIES, Report, Subject, check
from tests.soundness.subjects import DESIGN, mitsubas, ours

PAGE = Path(__file__).parents[2] / "docs/results/soundness.md"


def main() -> None:
    for name, subjects in (("mitsuba", mitsubas()), ("nacre", ours())):
        rows = "".join(table(subjects))
        text = PAGE.read_text(encoding="utf-8")
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->\n"
        start, stop = text.index(begin) + len(begin), text.index(end)
        PAGE.write_text(f"{text[:start]}{rows}{text[stop:]}", encoding="utf-8")


def table(subjects: Iterable[tuple[str, Callable[[], Subject]]]) -> Iterator[str]:
    """Rows of Markdown, one for each material."""
    yield f"| material | properties that pass, of {len(PROPERTIES)} | what does not pass |\n"
    yield "|---|--:|---|\n"
    for name, make in subjects:
        print(name, file=sys.stderr)
        try:
            made = make()
        except NacreError as error:
            yield f"| {name} | | {str(error).removeprefix(f'{name}: ')} |\n"
            continue
        made.by_design = {**made.by_design, **DESIGN.get(name, {})}
        report = check(made)
        passed = sum(result.state == "passed" for result in report.results)
        yield f"| {name} | {passed} | {' '.join(_notes(report))} |\n"


def _notes(report: Report) -> Iterator[str]:
    for result in report.results:
        if result.state == "failed":
            where = f" Worst at {result.where}." if result.where is not None else ""
            yield f"**{result.property}** fails: {result.sentence}{where}"
        elif result.state == "by design":
            size = f"{result.size:.2g}"
            reason = report_reason(result.sentence)
            yield f"{result.property} ({size}): by design, {reason}."
        elif result.state == "not applicable":
            reason = result.sentence.removeprefix("Not applicable: ").removesuffix(".")
            yield f"{result.property}: not applicable, {reason}."


def report_reason(sentence: str) -> str:
    """The reason why a property does not hold by design."""
    return sentence.rpartition("By design: ")[2].removesuffix(".")


if __name__ == "__main__":
    main()
