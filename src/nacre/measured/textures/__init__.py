"""Measured textures: one module a file format."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "domes": ["BONN", "UTIA", "Dome"],
        "photographs": ["load_photographs"],
        "transposition": ["transposed"],
    },
)
