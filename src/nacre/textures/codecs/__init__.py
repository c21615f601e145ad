"""Texture codecs: what makes codes of texels, and reflectance of codes."""

from nacre.textures.codecs.codec import CODECS, LinearBlock, TexelCodec, TexelMap, TrainingRun
from nacre.textures.codecs.codec_file import PRETRAINED, PUBLISHED, load_codec, save_codec

__all__ = [
    "CODECS", "PRETRAINED", "PUBLISHED", "LinearBlock", "TexelCodec", "TexelMap", "TrainingRun",
    "load_codec", "save_codec",
]  # fmt: skip
