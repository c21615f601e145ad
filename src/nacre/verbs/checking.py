"""`nacre.check`: whether a material of any origin is sound."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from nacre.errors import FormatError, NacreError
from nacre.included import Material
from nacre.io.files import PathLike, atomic_path
from nacre.runtime.progress import Progress
from nacre.soundness import Plan, Report, Result, Subject, described, in_scene, subject
from nacre.soundness import check as checked
from nacre.soundness.exported import ENDINGS, ExportedC
from nacre.verbs.material import Given, label, opened
from nacre.verbs.tables import html_table, text_table, value_text

Checkable: TypeAlias = Given | Mapping[str, Any] | Subject | Any
"""What :func:`check` takes."""

_PLUGIN = re.compile(r"[a-z][a-z_0-9]*")
_HEAD = 4096  # bytes in which the first element of a scene stands


@dataclass(frozen=True, repr=False, eq=False)
class Checked:
    """The properties of a material, each with its state; shows itself as a table."""

    report: Report

    @property
    def sound(self) -> bool:
        """Whether nothing failed; what is so by design does not count."""
        return self.report.sound

    @property
    def failures(self) -> tuple[Result, ...]:
        """The results that failed."""
        return self.report.failures

    def __getitem__(self, name: str) -> Result:
        """The result of a property. Raises KeyError if it was not checked."""
        return self.report[name]

    def save(self, path: PathLike) -> Path:
        """Write a page with a picture for each property (`.html`); returns the path.

        Raises FormatError if it cannot be written, MissingExtraError without Matplotlib.
        """
        return write_page([self.report], path)

    def _rows(self) -> list[tuple[str, str, str, str]]:
        return [
            (each.property, each.state, "" if each.size is None else value_text(each.size),
             each.sentence)
            for each in self.report.results
        ]  # fmt: skip

    def __repr__(self) -> str:
        return f"{self.report.name}: {verdict(self.report)}\n{text_table(self._rows())}"

    def _repr_html_(self) -> str:
        return html_table(self._rows())


def check(
    material: Checkable,
    *,
    only: Iterable[str] = (),
    bsdf: str | None = None,
    samples: int = Plan.samples,
    seed: int = 0,
    progress: Progress | None = None,
) -> Checked:
    """Check whether a BSDF is sound: reciprocity, energy, densities and more.

    Parameters
    ----------
    material
        A reflectance, its path or name; a Mitsuba scene (`.xml`); C that was exported (`.c`, `.h`),
        which is compiled and run; the name of one of Mitsuba's
        BSDFs, "roughconductor", a dictionary for `mitsuba.load_dict`, or a BSDF of the variant
        `llvm_ad_rgb`; any object with `eval(wi, wo)`, and perhaps `sample`, `pdf`, `gradient` and
        `variants`, as :class:`nacre.soundness.python_object.ObjectSubject` says.
    only
        Names of properties to check, of :data:`nacre.soundness.PROPERTIES`; all where empty.
    bsdf
        Id of the BSDF in a scene that has several.
    samples
        Directions drawn for each of five views where densities are compared with samples.
    seed
        Chooses the directions; the same seed gives the same report.
    progress
        Called before each property.

    Raises
    ------
    FormatError
        If a file cannot be read, or holds a texture.
    NacreError
        If the material cannot be evaluated, or a property is not known.
    MissingExtraError, LLVMError
        If Mitsuba is needed and cannot run here.

    Examples
    --------
    >>> import nacre
    >>> from nacre.analytic.lambert import Lambert
    >>> nacre.check(Lambert(diffuse=(0.5, 0.5, 0.5)), only=["energy", "reciprocity"]).sound
    True
    """
    found = checkable(material, bsdf)
    return Checked(checked(found, Plan(samples, seed), only, progress))


def checkable(material: Checkable, bsdf: str | None = None) -> Subject:
    """What is checked of a material; arguments and errors are those of :func:`check`."""
    if not isinstance(material, str | os.PathLike | Material):
        if bsdf is not None:
            raise NacreError("an id of a BSDF is for a scene (.xml)")
        return subject(material)
    text = material.name if isinstance(material, Material) else os.fspath(material)
    scene, _, identifier = text.rpartition("#")
    if scene and Path(scene).exists():
        return in_scene(scene, identifier)
    path = Path(text)
    if path.exists() and _is_scene(path):
        return in_scene(path, bsdf)
    if path.exists() and path.suffix.lower() in ENDINGS and bsdf is None:
        return ExportedC(path)
    if bsdf is not None:
        raise NacreError(f"{text}: is not a scene (.xml), so it has no BSDF {bsdf!r}")
    if text.startswith("{"):
        from nacre.measuring.bsdf import description

        return described(description(text))
    if not path.exists() and _PLUGIN.fullmatch(text):
        return _plugin(text)
    return subject(opened(material), label(material))


def _plugin(name: str) -> Subject:
    """One of Mitsuba's BSDFs with its default parameters."""
    try:
        return described({"type": name})
    except NacreError as error:
        if "unknown plugin" not in str(error):
            raise
        problem = "there is no such file, and Mitsuba has no BSDF of that name"
        raise NacreError(f"{name}: {problem}") from error


def _is_scene(path: Path) -> bool:
    """Whether a file is Mitsuba's: other kinds of XML hold measurements."""
    if path.suffix.lower() != ".xml":
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return b"<scene" in head or b"<bsdf" in head


def verdict(report: Report) -> str:
    """A report in a few words."""
    failed = [each.property for each in report.failures]
    return f"fails {', '.join(failed)}" if failed else "is sound"


def write_page(reports: Iterable[Report], path: PathLike) -> Path:
    """Write reports as one page (`.html`); returns the path. Raises as :meth:`Checked.save`."""
    from nacre.figures.soundness_page import soundness_page

    path = Path(path)
    check_page_path(path)
    text = soundness_page(list(reports))
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def check_page_path(path: Path) -> None:
    """Raise FormatError if a page cannot have this name."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise FormatError(f"{path}: expected a name that ends in .html")
