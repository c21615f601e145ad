"""The verbs of the command line as functions: `nacre.render(...)` and so on.

Each takes materials or paths, and gives back something that shows itself in a notebook and can be
saved. Keywords have the names of the command's options.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.verbs.checking import Checked, check
    from nacre.verbs.comparing import Compared, compare
    from nacre.verbs.converting import convert
    from nacre.verbs.estimating import estimate
    from nacre.verbs.exporting import Exported, export
    from nacre.verbs.fitting import fit
    from nacre.verbs.inspecting import Facts, info
    from nacre.verbs.picture import Picture
    from nacre.verbs.plotting import Plot, plot
    from nacre.verbs.rendering import render
    from nacre.verbs.viewing import Page, view

__all__ = [
    "Checked",
    "Compared",
    "Exported",
    "Facts",
    "Page",
    "Picture",
    "Plot",
    "check",
    "compare",
    "convert",
    "estimate",
    "export",
    "fit",
    "info",
    "plot",
    "render",
    "view",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "checking": ["Checked", "check"],
        "comparing": ["Compared", "compare"],
        "converting": ["convert"],
        "estimating": ["estimate"],
        "exporting": ["Exported", "export"],
        "fitting": ["fit"],
        "inspecting": ["Facts", "info"],
        "picture": ["Picture"],
        "plotting": ["Plot", "plot"],
        "rendering": ["render"],
        "viewing": ["Page", "view"],
    },
)
