"""Codecs of texels: what makes a few values of a texel and reflectance of these."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={"codec": ["TexelCodec"], "codec_file": ["load_codec", "save_codec"]},
)
