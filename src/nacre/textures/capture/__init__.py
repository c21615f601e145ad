"""A virtual gonioreflectometer, and recipes of surfaces for it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "gonioreflectometer": ["capture"],
        "mesostructure": ["Mesostructure"],
        "recipe": ["Recipe", "built_in", "find"],
    },
)
