"""What a page holds of materials and environments."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from nacre.array import Image
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.errors import require
from nacre.export.glsl import Glsl
from nacre.export.textures import HeightField
from nacre.metrics import compare
from nacre.neural.file import encode
from nacre.neural.nbrdf import NeuralBrdf
from nacre.render.environment import Environment
from nacre.render.lights import EnvironmentLight, Light
from nacre.render.sphere import render_sphere
from nacre.runtime.progress import Progress, silent
from nacre.viewer.environments import MAP_SIZE, shared_exponents, smaller
from nacre.viewer.page import PAGE, document
from nacre.viewer.programs import NAME, input_sources, key_of, sampler_source, template
from nacre.viewer.tables import SAMPLER, as_table
from nacre.viewer.textures import GLSL, PageTexture, formulas, from_above, relief

_THUMBNAIL = 96  # pixels along an edge
_QUALITY = 80
_DIRECTIONS = 192  # of light
_GROUND = 0.1  # as behind the page's pictures
_LONGEST = 200
"""Characters of a fact that a page shows."""

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


@dataclass(frozen=True)
class Entry:
    """A material of a page.

    Parameters
    ----------
    name
        For people.
    forms
        What it is shown as, by a word for each; the first is shown first.
    group
        Heading of the shelf under which it stands.
    facts
        More to say of it than its forms do.
    reference
        The form by which the errors of the others are told, as `nacre compare` measures them; empty
        for none.
    """

    name: str
    forms: Mapping[str, Brdf]
    group: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    reference: str = ""


class Content:
    """What a page shows, gathered piece by piece; :meth:`page` is the whole.

    Parameters
    ----------
    environments
        At least one. They are exposed; the first lights the thumbnails.
    thumbnails
        Whether materials have some, as a shelf needs them.

    Attributes
    ----------
    facts, parts
        JSON and bytes as the page's scripts read them.
    """

    def __init__(self, environments: Sequence[Environment], *, thumbnails: bool = True) -> None:
        self._light = None
        if thumbnails:
            self._light = EnvironmentLight(environments[0].exposed(), _DIRECTIONS)
        self.parts: dict[str, bytes] = {}
        self.facts: dict[str, Any] = {"materials": [], "templates": [], "environments": []}
        self.facts |= {"sampler": sampler_source(SAMPLER), "inputs": input_sources()}
        for environment in environments:
            self._add_environment(environment)

    def add(self, entry: Entry) -> None:
        """One more material.

        Raises NacreError if a form of it is no formula; the message says what makes one of it.
        """
        index = len(self.facts["materials"])
        forms = []
        for label, brdf in entry.forms.items():
            known = _known(brdf)
            if entry.reference and label != entry.reference:
                known[f"Against {entry.reference}"] = _errors(entry.forms[entry.reference], brdf)
            form = {"label": label, "known": known}
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
        """One more texture, which is encoded.

        Raises NacreError if no page holds it; the message says why.

        Parameters
        ----------
        texture
            See :class:`nacre.viewer.textures.PageTexture`.
        heights
            For parallax.
        facts
            More to say of it.
        progress
            Called with the numbers done.
        """
        held = self.facts.setdefault("textures", [])
        if GLSL not in self.facts:
            self.facts[GLSL] = self.part(GLSL, formulas().encode())
        name = f"texture {len(held)}"
        packed = PageTexture.of(texture, progress)
        parts = {each: self.part(f"{name} {each}", of) for each, of in packed.parts().items()}
        known = {
            "Texels": f"{texture.width} x {texture.height}",
            "Error of the codes": _error(texture.describe().get("MSE x 1e4")),
            "Added on this page": _error(1e4 * packed.error),
        }
        shown: dict[str, Any] = {"name": texture.name[:_LONGEST], "parts": parts}
        shown["known"] = {key: said for key, said in known.items() if said} | dict(facts or {})
        shown["thumbnail"] = self.part(f"{name} thumbnail", _jpeg(tone_map(from_above(texture))))
        if heights is not None:
            relief_facts, field = relief(heights)
            shown["relief"] = relief_facts | {"part": self.part(f"{name} relief", field)}
        held.append(shown | packed.facts())

    def allow(self, network: NeuralBrdf) -> None:
        """Hold what shows this network, and others of its shape."""
        key = key_of(network)
        if all(known["key"] != key for known in self.facts["templates"]):
            self.facts["templates"].append(asdict(template(network)))

    def part(self, name: str, content: bytes) -> str:
        """Keep bytes under a name, which is returned."""
        self.parts[name] = content
        return name

    def page(self, title: str, files: tuple[str, str, str] = PAGE) -> bytes:
        """The page, as UTF-8; it needs nothing but a browser."""
        return document(title, self.facts, self.parts, files)

    def _form(self, name: str, brdf: Brdf) -> dict[str, Any]:
        if (table := as_table(brdf)) is not None:
            grids = {
                key: {**grid.facts(), "part": self.part(f"{key} {name}", grid.values.tobytes())}
                for key, grid in table.grids.items()
            }
            return {"table": {**table.facts, "grids": grids}}
        if not isinstance(brdf, NeuralBrdf):
            text = "\n\n".join(Glsl().written(brdf, NAME).values())
            return {"glsl": self.part(f"glsl {name}", text.encode())}
        self.allow(brdf)
        return {"file": self.part(f"file {name}", encode(brdf))}

    def _add_environment(self, environment: Environment) -> None:
        name = self.part(
            f"environment {len(self.facts['environments'])}",
            shared_exponents(smaller(environment.exposed().pixels)),
        )
        width, height = MAP_SIZE
        shown = {"name": environment.name, "part": name, "width": width, "height": height}
        self.facts["environments"].append(shown)


def page(
    title: str,
    entries: Sequence[Entry],
    environments: Sequence[Environment],
) -> bytes:
    """A page of materials under environments, as UTF-8; see :class:`Content`."""
    content = Content(environments)
    for entry in entries:
        content.add(entry)
    return content.page(title)


def _known(brdf: Brdf) -> dict[str, str]:
    known = brdf.describe()
    return {
        title: _said(known[name])[:_LONGEST]
        for name, title in _FACTS.items()
        if known.get(name) is not None
    }


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
    """A JPEG of a sphere, of `size` pixels along an edge.

    Raises MissingExtraError if Pillow is not installed.
    """
    image, mask = render_sphere(brdf, light, size)
    return _jpeg(np.where(mask[..., None], tone_map(image), _GROUND), size)


def _error(squared: object) -> str:
    """Of reflectance factors, as people compare it with 1, a white surface."""
    return f"{math.sqrt(1e-4 * squared):.2g} (RMSE)" if isinstance(squared, float) else ""


def _jpeg(shown: Image, size: int = _THUMBNAIL) -> bytes:
    """A picture of what screens show, from 0 to 1, of at most `size` pixels along an edge."""
    picture = require("PIL.Image", "view").fromarray(np.round(255.0 * shown).astype(np.uint8))
    picture.thumbnail((size, size))
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=_QUALITY)
    return stream.getvalue()
