"""`nacre.compare`: one material against another, in numbers and in a picture."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.runtime.progress import Progress, silent
from nacre.verbs.material import Given, label, opened
from nacre.verbs.picture import Picture
from nacre.verbs.tables import html_table, text_table, value_text

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity
    from nacre.metrics.comparison import Comparison
    from nacre.metrics.texture_comparison import TextureComparison
    from nacre.metrics.verdict import Verdict


@dataclass(frozen=True, repr=False, eq=False)
class Compared:
    """How far a material is from a reference."""

    reference: str  # names; `other` is what is judged
    other: str
    figures: Mapping[str, Mapping[str, float]]
    """Measures by name, as `nacre compare` prints them: under the lights "environment" and
    "directional", over pairs of directions, "angles", and of spectra, "colors"; for a texture over
    its "values", by "views", and of its "worst texels"."""
    verdict: Verdict
    """Whether a viewer would see the difference."""
    details: Comparison | TextureComparison
    """All that was computed."""
    draw: Callable[[], Any]
    """Draws :attr:`picture`."""

    @cached_property
    def picture(self) -> Picture:
        """Reference, other and their difference, side by side, as display values.

        Raises MissingExtraError if Matplotlib is not installed.
        """
        return Picture.of(self.draw())

    def save(self, path: PathLike) -> Path:
        """Write the picture (`.png`, `.jpg`); returns the path."""
        return self.picture.save(path)

    def _rows(self) -> list[tuple[str, str, str]]:
        rows = []
        for where, measures in self.figures.items():
            for index, (measure, value) in enumerate(measures.items()):
                rows.append(("" if index else where, measure, value_text(value)))
        return rows

    def __repr__(self) -> str:
        return f"{self.other} against {self.reference}\n{text_table(self._rows())}\n{self.verdict}"

    def _repr_html_(self) -> str:
        drawn = base64.b64encode(self.picture._repr_png_() or b"").decode()
        return f'<img src="data:image/png;base64,{drawn}">{html_table(self._rows())}'


def compare(
    reference: Given,
    other: Given,
    *,
    environment: Any = None,
    size: int = 128,
    pairs: int | None = None,
    seed: int = 0,
    pixels: Quantity | None = None,
    progress: Progress | None = None,
) -> Compared:
    """Compare a material with a reference: both reflectances, or both textures.

    Reflectances are compared on rendered spheres and over pairs of directions. Textures must have
    the same pairs of directions; an encoded one is decoded at those of the reference.

    Parameters
    ----------
    reference, other
        Materials, paths or names.
    environment
        Latitude-longitude map that lights the spheres: a path, or a
        :class:`nacre.mitsuba.environment.Environment`; a built-in studio where None.
    size
        Width and height of each sphere in pixels, at least 7; figures compare at one size only.
    pairs
        Random pairs of directions to compare of textures; all where None.
    seed
        Of the random pairs of directions.
    pixels
        Meaning of the pixels of a texture in a folder of images; see :func:`nacre.load`.
    progress
        Called as the work goes on.

    Raises
    ------
    FormatError
        If a file cannot be read, or one is a reflectance and the other a texture.
    NacreError
        If textures have different sizes or directions.
    MissingExtraError
        If scikit-image is not installed.
    """
    first, second = (opened(each, quantity=pixels) for each in (reference, other))
    names = label(reference), label(other)
    if names[0] == names[1]:
        names = names[0], f"{names[1]} ({type(second).__name__})"
    if isinstance(first, Brdf) and isinstance(second, Brdf):
        return _reflectances(first, second, names, environment, size, seed, progress or silent)
    if isinstance(first, Btf) and isinstance(second, Btf):
        return _textures(first, second, names, pairs, seed, progress or silent)
    kinds = ["a reflectance" if isinstance(each, Brdf) else "a texture" for each in (first, second)]
    raise FormatError(
        f"{names[1]}: is {kinds[1]}, but {names[0]} is {kinds[0]}; nacre.textures.average makes a "
        "texture of one texel from a texture, nacre.textures.tile a texture from a reflectance"
    )


def _reflectances(
    first: Brdf,
    second: Brdf,
    names: tuple[str, str],
    environment: Any,
    size: int,
    seed: int,
    progress: Progress,
) -> Compared:
    from nacre.instruments.differences import spectral_differences
    from nacre.metrics import compare
    from nacre.verbs.rendering import lighting

    found = compare(
        first,
        second,
        size=size,
        environment=lighting(environment),
        seed=seed,
        progress=lambda part: progress("comparing", round(100 * part), 100, ""),
    )
    colors = spectral_differences(first, second, seed=seed)
    found = replace(found, truth=names[0], other=names[1], colors=colors)
    figures: dict[str, dict[str, float]] = {}
    for where, measure, value in found.rows():
        figures.setdefault(where, {})[measure] = value

    def draw() -> Any:
        from nacre.figures import picture

        return picture(found)

    return Compared(*names, figures, found.verdict, found, draw)


def _textures(
    first: Btf,
    second: Btf,
    names: tuple[str, str],
    pairs: int | None,
    seed: int,
    progress: Progress,
) -> Compared:
    from nacre.figures.texture_sheet import texture_rows, texture_sheet, texture_verdict
    from nacre.measured.textures.transposition import transposed
    from nacre.metrics.texture_comparison import compare_textures

    with ExitStack() as stack:
        a, b = (stack.enter_context(transposed(btf, progress=progress)) for btf in (first, second))
        found = compare_textures(a, b, pairs=pairs, seed=seed, progress=progress)
    shown, by_view = found.errors.shown()
    worst = {f"column {x}, row {y}": 1e4 * mse for x, y, mse in found.worst()}
    figures = {
        "values": {"pairs compared": found.compared, **shown},
        "views": {f"MSE x 1e4, {name}": value for name, value in by_view.items()},
        "worst texels": {f"MSE x 1e4, {where}": value for where, value in worst.items()},
    }

    rows = texture_rows(first, second)

    def draw() -> Any:
        return texture_sheet(first, second, names, rows=rows)

    return Compared(*names, figures, texture_verdict(rows), found, draw)
