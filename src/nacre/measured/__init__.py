"""Measured reflectance: one module a file format."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submodules=["textures"],
    submod_attrs={
        "mbsdf_table": ["MbsdfBrdf"],
        "merl_table": ["MerlBrdf"],
        "rgl": ["RglBrdf"],
        "scattered": ["ScatteredBrdf"],
        "utia": ["UtiaBrdf"],
    },
)
