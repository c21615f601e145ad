"""Textures of measured reflectance: read, captured virtually, encoded by one shared model."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submodules=["capture", "codecs", "rates", "synthesis"],
    submod_attrs={
        "latent_file": ["load_latent_map", "save_latent_map"],
        "latent_map": ["LatentMap", "NeuralBtf"],
        "limit": ["Rate", "limited"],
        "mipmap": ["LatentPyramid"],
        "uniform": ["TexelBrdf", "average", "tile"],
    },
)
