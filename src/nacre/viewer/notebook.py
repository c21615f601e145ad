"""How notebooks show a reflectance: as a small live sphere."""

from __future__ import annotations

import base64
import html

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.studio import studio
from nacre.viewer.content import Content, Entry, thumbnail
from nacre.viewer.page import SPHERE

_SIZE = 240  # pixels along an edge
_LARGEST = 1 << 18  # bytes of a material's numbers, which are saved in each cell that shows it
_COVER = "position:absolute;top:0;left:0;width:100%;height:100%;border:0"


def live(material: object) -> str:
    """HTML for a reflectance's sphere, which turns by pointer or arrow keys; "" for anything else.

    It is a still picture below a frame with its own page. The picture remains if a notebook, or a
    document made from it, allows no frames, or the browser has no WebGL2.
    """
    if not isinstance(material, Brdf):
        return ""
    still = base64.b64encode(thumbnail(material, DirectionalLight(), _SIZE)).decode()
    name = html.escape(material.name or type(material).__name__)
    place = f"position:relative;width:{_SIZE}px;height:{_SIZE}px"
    picture = (
        f'<img src="data:image/jpeg;base64,{still}" alt="{name}" width="{_SIZE}" height="{_SIZE}" '
        f'style="{_COVER};clip-path:circle(48%)">'
    )
    return f'<div style="{place}">{picture}{_frame(material, name)}</div>'


def _frame(brdf: Brdf, name: str) -> str:
    """The page over the picture; "" if it is too large to keep in a notebook, or no formula."""
    if (brdf.nbytes or 0) > _LARGEST:
        return ""
    content = Content([studio()], thumbnails=False, tabulate=False)
    try:
        content.add(Entry(brdf.name, {type(brdf).__name__: brdf}))
    except NacreError:
        return ""
    page = html.escape(content.page(brdf.name, SPHERE).decode())
    return (
        f'<iframe srcdoc="{page}" title="{name}, live" sandbox="allow-scripts" '
        f'style="{_COVER}"></iframe>'
    )
