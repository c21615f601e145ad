"""New textures from old ones: larger ones by quilting, and mixtures of two."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"blending": ["blend"], "quilted_map": ["QuiltedMap", "synthesize"]}
)
