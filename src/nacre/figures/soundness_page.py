"""The report of a check as one web page that needs nothing else."""

from __future__ import annotations

import html
from collections.abc import Sequence

from nacre.errors import printable
from nacre.figures.hemisphere import hemisphere_map, inlined
from nacre.soundness import Report, Result

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem;
  color: #202124; background: #fff }
table { border-collapse: collapse; width: 100%; margin-bottom: 2rem }
th, td { text-align: left; vertical-align: top; padding: .4rem .8rem .4rem 0;
  border-top: 1px solid #d0d0cd }
td.number { text-align: right; font-variant-numeric: tabular-nums }
img { width: 11rem; height: 11rem; display: block }
.failed { color: #b3261e; font-weight: 600 } .passed { color: #1b6e3c }
.design { color: #8a5a00 } .none { color: #65676b }
"""
_CLASSES = {"passed": "passed", "failed": "failed", "by design": "design", "not applicable": "none"}


def soundness_page(reports: Sequence[Report]) -> str:
    """One HTML page with a table for each material, and a picture for each property.

    The page makes no network requests. Raises MissingExtraError if Matplotlib is not installed.
    """
    title = f"Soundness: {', '.join(report.name for report in reports)}"
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{_text(title)}</title>',
        f"<style>{_STYLE}</style></head><body>",
        "<h1>Soundness</h1>",
        "<p>Pictures show directions to the light, and directions to the viewer for energy and "
        "normalization: the middle is the normal, the rim the horizon. Darker dots violate the "
        "property more, gray ones do not, and red ones have no finite value. Angles are in "
        "degrees: the polar angle, then the azimuth.</p>",
    ]
    for report in reports:
        verdict = "sound" if report.sound else f"{len(report.failures)} failed"
        parts.append(f"<h2>{_text(report.name)}: {verdict}</h2><table>")
        parts.append(
            "<tr><th>property</th><th>state</th><th>size</th><th>limit</th><th>found</th><th></th></tr>"
        )
        parts += [_row(result) for result in report.results]
        parts.append("</table>")
    return "\n".join([*parts, "</body></html>", ""])


def _row(result: Result) -> str:
    numbers = ("" if value is None else f"{value:.3g}" for value in (result.size, result.limit))
    found = _text(result.sentence)
    if result.where is not None:
        found += f"<br>Worst at {_text(str(result.where))}."
    picture = ""
    if result.outcome is not None and len(result.outcome.wi):
        drawn = inlined(hemisphere_map(result.outcome))
        picture = f'<img src="{drawn}" alt="Where {result.property} is violated">'
    cells = "".join(f'<td class="number">{number}</td>' for number in numbers)
    state = f'<td class="{_CLASSES[result.state]}">{result.state}</td>'
    return f"<tr><th>{result.property}</th>{state}{cells}<td>{found}</td><td>{picture}</td></tr>"


def _text(words: str) -> str:
    return html.escape(printable(words))
