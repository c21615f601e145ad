"""Principal components of texels: what every other codec is measured against."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"analysis": ["PcaRecipe"], "codec": ["PcaCodec", "find_components"]}
)
