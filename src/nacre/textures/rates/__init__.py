"""Codes of textures in a chosen number of bytes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"limit": ["Rate", "limited"], "rated_codes": ["RatedCodes"]}
)
