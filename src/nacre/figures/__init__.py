"""All drawing: pictures of comparisons, lobe plots, sheets of textures, pages of figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.figures.comparison_sheet import picture
    from nacre.figures.lobes import Lobe, lobe
    from nacre.figures.plot import lobe_figure, write_plot

__all__ = ["Lobe", "lobe", "lobe_figure", "picture", "write_plot"]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "comparison_sheet": ["picture"],
        "lobes": ["Lobe", "lobe"],
        "plot": ["lobe_figure", "write_plot"],
    },
)
