"""A live picture of a reflectance in a notebook that follows what Python sets: an anywidget.

from nacre.viewer.widget import view
picture = view(brdf, shape="knot")
picture.light = "room"

"""

from __future__ import annotations

import functools
from typing import Any

from nacre.brdf import Brdf
from nacre.errors import require
from nacre.viewer.content import Content, Entry, own_environments
from nacre.viewer.page import gathered, script


def view(
    brdf: Brdf,
    *,
    shape: str = "sphere",
    light: str = "studio",
    exposure: float = 0.0,
    size: int = 360,
) -> Any:
    """An `anywidget.AnyWidget` that shows a reflectance; its attributes may change at any time.

    Parameters
    ----------
    brdf
        The reflectance.
    shape
        "sphere", "ball", "knot" or "cloth".
    light
        One of :data:`nacre.mitsuba.surroundings.ENVIRONMENTS`, or "lamp".
    exposure
        In stops.
    size
        Pixels along an edge.

    Raises
    ------
    MissingExtraError
        If anywidget is not installed.
    NacreError
        If a page cannot show the reflectance; the message tells how to convert it.
    """
    return _widget()(brdf=brdf, shape=shape, light=light, exposure=exposure, size=size)


def module() -> str:
    """The widget's ECMAScript module."""
    return f"{script('widget')}\nexport default {{ render: of_widget.render }};\n"


def content_of(brdf: Brdf) -> bytes:
    """The module's data: a reflectance and the package's environments, gzipped.

    Raises NacreError as :meth:`nacre.viewer.content.Content.add` does.
    """
    content = Content(own_environments(), thumbnails=False, tabulate=False)
    content.add(Entry(brdf.name, {type(brdf).__name__: brdf}))
    return gathered(content.facts, content.parts)


@functools.cache
def _widget() -> type[Any]:
    base: Any = require("anywidget", "notebook").AnyWidget
    traitlets = require("traitlets", "notebook")

    class View(base):  # type: ignore[misc]
        """A reflectance in a notebook; see :func:`view`."""

        _esm = module()
        brdf = traitlets.Instance(Brdf)
        content = traitlets.Bytes().tag(sync=True)
        shape = traitlets.Unicode().tag(sync=True)
        light = traitlets.Unicode().tag(sync=True)
        exposure = traitlets.Float().tag(sync=True)
        size = traitlets.Int(min=16, max=2048).tag(sync=True)

        def __init__(self, **settings: Any) -> None:
            super().__init__(content=content_of(settings["brdf"]), **settings)

        @traitlets.observe("brdf")  # type: ignore[untyped-decorator]
        def _changed(self, change: Any) -> None:
            self.content = content_of(change["new"])

    return View
