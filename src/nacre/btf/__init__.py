"""Textures of measured reflectance: read, captured virtually, encoded by one shared model."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "codec": ["TexelCodec"],
        "codec_file": ["load_codec", "save_codec"],
        "domes": ["BONN", "UTIA", "Dome"],
        "encoding": ["encode"],
        "formats": ["load", "save"],
        "latent_file": ["load_latent_map", "save_latent_map"],
        "latent_map": ["LatentMap", "NeuralBtf"],
        "mipmap": ["LatentPyramid"],
        "photographs": ["load_photographs"],
        "texture": ["Btf", "TableBtf"],
        "transposition": ["by_texel"],
        "uniform": ["TexelBrdf", "average", "spread"],
    },
)
