"""Table 2: codes of all materials, of those seen in training and of those held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from nacre.runtime.progress import Progress
from nacre_lab.reproduce.codes import CODES, CodeSettings, code_methods
from nacre_lab.reproduce.experiment import Outcome, Request
from nacre_lab.reproduce.representations import OPTIONS, Comparison, every
from nacre_lab.reproduce.study import Study
from nacre_lab.reproduce.summary import cell, summarize
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.trial import LIGHTS, Method, Settings

_ALL, _SEEN, _HELD_OUT = "all", "seen", "held out"
_PAPER = (
    ("the paper's NBRDF autoencoder", "0.0178 ± 0.013", "0.0194 ± 0.014", "0.968 ± 0.031"),
    ("the paper's PCA (Nielsen et al. 2015)", "0.0199 ± 0.008", "0.0227 ± 0.009", "0.982 ± 0.007"),
)
"""NBRDF paper, Table 2: over all materials of MERL, four fifths of them used in training."""


@dataclass(frozen=True, kw_only=True)
class CodeComparison(Comparison):
    """Codes of all materials from bases trained on four fifths of them."""

    heeds: frozenset[str] = OPTIONS

    def candidates(
        self, request: Request, settings: Settings
    ) -> tuple[Mapping[str, Method], Settings]:
        chosen = request.known_methods(CODES) or list(CODES)
        shared = CodeSettings(**{f.name: getattr(settings, f.name) for f in fields(settings)})
        if request.quick:
            shared = shared.quick()
        return code_methods(request.files, chosen, shared, request.cache, request.progress)

    def results(self, study: Study, chosen: Sequence[str]) -> list[str]:
        groups = _groups(study)
        parts = [f"**Held out:** {', '.join(groups[_HELD_OUT].materials)}.\n"]
        for title, figures in self.tables.items():
            heads = [figure.removeprefix(f"{title} ") for figure in figures]
            lines = [
                (
                    method,
                    f"{study.mean_size(method):,.0f}",
                    label,
                    *(cell(summarize(part.of(method), figure), figure) for figure in figures),
                )
                for method in study.tried(chosen)
                for label, part in groups.items()
                if part.of(method)
            ]
            if title == LIGHTS[0]:
                lines += [(name, "–", _ALL, *figures, "–") for name, *figures in _PAPER]
            table = markdown_table(("method", "bytes", "materials", *heads), lines)
            parts += [f"## {title}\n", table]
        return parts

    def outcome(
        self, name: str, study: Study, chosen: Sequence[str], progress: Progress
    ) -> Outcome:
        found = super().outcome(name, study, chosen, progress)
        held_out = set(_groups(study)[_HELD_OUT].materials)
        trials = [trial for method in chosen for trial in study.of(method)]
        rows = [
            (*row, _HELD_OUT if trial.material in held_out else _SEEN)
            for trial, row in zip(trials, found.rows, strict=True)
        ]
        return replace(found, columns=[*found.columns, "materials"], rows=rows)


def _groups(study: Study) -> dict[str, Study]:
    """The study of all materials, of those used in training, and of those held out."""
    assert isinstance(study.settings, CodeSettings)
    parts: dict[str, dict[str, Path]] = {_SEEN: {}, _HELD_OUT: {}}
    for name, path in study.materials.items():
        parts[_HELD_OUT if path.stem in study.settings.held_out else _SEEN][name] = path
    return {_ALL: study, **{k: replace(study, materials=v) for k, v in parts.items()}}


TABLE2 = CodeComparison(
    title="codes of all materials, of those seen in training, and of those held out",
    choose=every,
    differs="the data differ: the materials named below instead of the 100 of MERL; spheres of "
    "`nacre compare` (fixed directions of light, no path tracing) instead of the paper's scene; "
    "nacre's own training of the autoencoder; principal components of colors instead of single "
    "channels; more codes than the paper's two",
    tables={x: tuple(f"{x} {m}" for m in ("MAE", "RMSE", "SSIM", "PSNR")) for x in LIGHTS},
)
