"""The default codec of texels: sums of smooth functions of light and view."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"codec": ["BasisCodec"], "recipe": ["BasisRecipe"]}
)
