"""Textures of measured reflectance: read, captured virtually, encoded by one shared model."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "codec": ["TexelCodec"],
        "domes": ["BONN", "UTIA", "Dome"],
        "formats": ["load", "save"],
        "photographs": ["load_photographs"],
        "texture": ["Btf", "TableBtf"],
        "transposition": ["by_texel"],
    },
)
