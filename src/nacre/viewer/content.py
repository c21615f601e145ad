"""The materials and environments on a page."""

from __future__ import annotations

import copy
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from nacre.analytic.model import AnalyticBrdf
from nacre.array import Image
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.metrics import compare
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import EnvironmentLight, Light
from nacre.mitsuba.sphere import render_sphere
from nacre.mitsuba.surroundings import ENVIRONMENTS
from nacre.neural.chain import ChainBrdf
from nacre.neural.file import encode
from nacre.neural.nbrdf import NeuralBrdf
from nacre.runtime.progress import Progress, silent
from nacre.targets.glsl import Glsl
from nacre.targets.textures import HeightField
from nacre.viewer import fits
from nacre.viewer.exports import hold, shared
from nacre.viewer.maps import coded
from nacre.viewer.page import PAGE, document, packed
from nacre.viewer.programs import NAME, input_sources, key_of, sampler_source, template
from nacre.viewer.tables import SAMPLER, as_table, tabulated
from nacre.viewer.textures import GLSL, PageTexture, formulas, from_above, relief

MAP_SIZE = 1024, 512
"""Pixels of a page's environments, width first; smaller ones stay as they are."""

_THUMBNAIL = 96  # pixels along an edge
_QUALITY = 80
_DIRECTIONS = 192  # of light
_GROUND = 0.1  # as behind the page's pictures
_LONGEST = 200  # characters of a fact that a page shows

_FACTS = {
    "model": "Model",
    "inputs": "Inputs",
    "layers": "Layers",
    "grid": "Grid",
    "memory bytes": "Bytes",
    "fitted to": "Fitted to",
    "held out loss": "Held-out loss",
    "terms of the source": "Terms",
}


def own_environments() -> list[Environment]:
    """The package's environments, as large as a page's."""
    return [made(MAP_SIZE[1]) for made in ENVIRONMENTS.values()]


@dataclass(frozen=True)
class Entry:
    """A material on a page.

    Parameters
    ----------
    name
        Shown to people.
    forms
        Its representations by label; the first is shown first.
    group
        Heading of its shelf.
    facts
        Facts beyond those of its forms.
    reference
        The form that errors of the others are measured against, as in `nacre compare`; empty for
        none.
    """

    name: str
    forms: Mapping[str, Brdf]
    group: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    reference: str = ""


class Content:
    """The content of a page, collected piece by piece; :meth:`page` returns the page.

    Parameters
    ----------
    environments
        At least one. They are exposed; the first lights the thumbnails.
    thumbnails
        Whether materials get thumbnails, as for a shelf.
    tabulate
        Whether a material without a formula becomes a table, which takes seconds.
    code
        Whether networks can be written as code on the page.

    Attributes
    ----------
    facts, parts
        JSON and bytes for the page's scripts.
    """

    def __init__(
        self,
        environments: Sequence[Environment],
        *,
        thumbnails: bool = True,
        tabulate: bool = True,
        code: bool = False,
    ) -> None:
        self._light, self._tabulate, self._prefix = None, tabulate, ""
        if thumbnails:
            self._light = EnvironmentLight(environments[0].exposed(), _DIRECTIONS)
        self.parts: dict[str, bytes] = {}
        self.facts: dict[str, Any] = {"materials": [], "templates": [], "environments": []}
        self.facts |= {"sampler": sampler_source(SAMPLER), "inputs": input_sources()}
        self._samplers: dict[str, Any] | None = None
        if code:
            self.facts["exports"] = exports = shared()
            self._samplers = exports["samplers"]
        for environment in environments:
            self._add_environment(environment)

    def beside(self, name: str) -> Content:
        """An empty content for a file beside the page, whose materials are loaded when asked for.

        It has the name of a kind of material; see :meth:`script`. What its networks need to be
        written as code is in the page, which is to be written after it.
        """
        other = copy.copy(self)
        other.parts, other._prefix = {}, f"{name} "
        other.facts = {"materials": [], "templates": []}
        return other

    def script(self, name: str) -> bytes:
        """The file beside a page: a script that hands over its materials, as `kinds.js` takes it.

        A page says in its fact `more` which there are: dictionaries with `name`, `title`, `count`
        of materials, `size` in words, and `src`, the file's place relative to the page.
        """
        content = packed(self.facts, self.parts).decode()
        return f'nacreMaterials("{name}", "{content}");\n'.encode()

    def add(self, entry: Entry) -> None:
        """Add a material.

        Raises NacreError if one of its forms is not a formula and may not be tabulated; the message
        tells how to make one.
        """
        index = len(self.facts["materials"])
        forms = []
        for label, brdf in entry.forms.items():
            known = _known(brdf)
            if entry.reference and label != entry.reference:
                known[f"Against {entry.reference}"] = _errors(entry.forms[entry.reference], brdf)
            form = {"label": label, "known": known, "kind": _kind(brdf)}
            forms.append(form | self._form(f"{index} {label}", brdf))
        shown = {"name": entry.name[:_LONGEST], "group": entry.group, "known": dict(entry.facts)}
        if self._light is not None:
            shot = thumbnail(next(iter(entry.forms.values())), self._light)
            shown["thumbnail"] = self.part(f"thumbnail {index}", shot)
        self.facts["materials"].append(shown | {"forms": forms})

    def add_texture(
        self,
        texture: Btf,
        heights: HeightField | None = None,
        facts: Mapping[str, str] | None = None,
        progress: Progress = silent,
    ) -> None:
        """Add an encoded texture (see :class:`nacre.viewer.textures.PageTexture`), with more facts.

        `heights` are for parallax. Raises NacreError if a page cannot hold it; the message says
        why.
        """
        held = self.facts.setdefault("textures", [])
        if GLSL not in self.facts:
            self.facts[GLSL] = self.part(GLSL, formulas().encode())
        name = f"texture {len(held)}"
        made = PageTexture.of(texture, progress)
        parts = {each: self.part(f"{name} {each}", of) for each, of in made.parts().items()}
        known = {
            "Texels": f"{texture.width} x {texture.height}",
            "Error of the codes": _error(texture.describe().get("MSE x 1e4")),
            "Added on this page": _error(1e4 * made.error),
        }
        shown: dict[str, Any] = {"name": texture.name[:_LONGEST], "parts": parts}
        shown["known"] = {key: said for key, said in known.items() if said} | dict(facts or {})
        shown["thumbnail"] = self.part(f"{name} thumbnail", _jpeg(tone_map(from_above(texture))))
        if heights is not None:
            relief_facts, field = relief(heights)
            shown["relief"] = relief_facts | {"part": self.part(f"{name} relief", field)}
        held.append(shown | made.facts())

    def allow(self, network: NeuralBrdf) -> None:
        """Include the template for this network and others with its shape."""
        key = key_of(network)
        if self._samplers is not None:
            hold(network.sampler, self._samplers)
        if all(known["key"] != key for known in self.facts["templates"]):
            self.facts["templates"].append(asdict(template(network)))

    def part(self, name: str, content: bytes) -> str:
        """Store bytes under a name, and return the name."""
        self.parts[self._prefix + name] = content
        return self._prefix + name

    def page(self, title: str, files: tuple[str, str, str] = PAGE) -> bytes:
        """The page, as UTF-8; it needs only a browser."""
        if files == PAGE:  # others show what they are given
            self.facts["fit"] = fits.facts(self.part("kernel", fits.kernel()))
        return document(title, self.facts, self.parts, files)

    def _form(self, name: str, brdf: Brdf) -> dict[str, Any]:
        text = ""
        if (table := as_table(brdf)) is None and not isinstance(brdf, NeuralBrdf):
            try:
                text = "\n\n".join(Glsl().written(brdf, NAME).values())
            except NacreError:  # a table, or scattered samples
                if not self._tabulate:
                    raise
                table = tabulated(brdf)
        if table is not None:
            grids = {
                key: {**grid.facts(), "part": self.part(f"{key} {name}", grid.values.tobytes())}
                for key, grid in table.grids.items()
            }
            return {"table": {**table.facts, "grids": grids}}
        if not isinstance(brdf, NeuralBrdf):
            return {"glsl": self.part(f"glsl {name}", text.encode())}
        self.allow(brdf)
        terms = (brdf.source or {}).get("terms")
        held = {"file": self.part(f"file {name}", encode(brdf))}
        return held | ({"terms": terms} if terms else {})

    def _add_environment(self, environment: Environment) -> None:
        content, facts = coded(_smaller(environment.exposed().pixels))
        name = self.part(f"environment {len(self.facts['environments'])}", content)
        self.facts["environments"].append({"name": environment.name, "part": name} | facts)


def _known(brdf: Brdf) -> dict[str, str]:
    known = brdf.describe()
    return {
        title: _said(known[name])[:_LONGEST]
        for name, title in _FACTS.items()
        if known.get(name) is not None
    }


def _kind(brdf: Brdf) -> str:
    """How a reflectance is held, in a word."""
    if isinstance(brdf, NeuralBrdf | ChainBrdf):
        return "neural"
    if not isinstance(brdf, AnalyticBrdf):
        return "measured"
    return "standard" if type(brdf).__module__.startswith("nacre.standard") else "analytic"


def _errors(reference: Brdf, brdf: Brdf) -> str:
    found = compare(reference, brdf)
    return "; ".join(
        f"{each.light} {each.errors.psnr:.1f} dB, FLIP {each.errors.flip:.3f}"
        for each in found.lights
    )


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.3g}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def thumbnail(brdf: Brdf, light: Light, size: int = _THUMBNAIL) -> bytes:
    """A JPEG of a sphere, with `size` pixels along an edge."""
    image, mask = render_sphere(brdf, light, size)
    return _jpeg(np.where(mask[..., None], tone_map(image), _GROUND), size)


def _error(squared: object) -> str:
    """The error of reflectance factors, for comparison with 1, a white surface."""
    return f"{math.sqrt(1e-4 * squared):.2g} (RMSE)" if isinstance(squared, float) else ""


def _jpeg(shown: Image, size: int = _THUMBNAIL) -> bytes:
    """A picture of display values from 0 to 1, with at most `size` pixels along an edge."""
    import PIL.Image

    picture = PIL.Image.fromarray(np.round(255.0 * shown).astype(np.uint8))
    picture.thumbnail((size, size))
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=_QUALITY)
    return stream.getvalue()


def _smaller(pixels: Image) -> Image:
    """A map (h, w, 3) in linear RGB at the page's size, by means over the cells of its texels.

    Rows have equal weights.
    """
    width, height = MAP_SIZE
    if pixels.shape[1] <= width and len(pixels) <= height:
        return pixels
    rows = np.linspace(0.0, len(pixels) - 1.0, height)
    columns = (np.arange(width) + 0.5) * pixels.shape[1] / width - 0.5
    factor = max(1, round(len(pixels) / height))
    offsets = (np.arange(factor) + 0.5) / factor - 0.5
    total = np.zeros((height, width, 3))
    for dy in offsets:
        for dx in offsets:
            y = np.clip(np.round(rows + dy * len(pixels) / height), 0, len(pixels) - 1).astype(int)
            x = np.round(columns + dx * pixels.shape[1] / width).astype(int) % pixels.shape[1]
            total += pixels[y[:, None], x]
    return np.asarray(total / factor**2, np.float32)
