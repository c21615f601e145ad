"""The tables and figures of "Unified Neural Encoding of BTFs", made again from any textures.

Codecs (:mod:`nacre_lab.reproduce.textures.methods`) are found or trained once and kept as files,
and so is what they make of each texture (:mod:`nacre_lab.reproduce.textures.study`); each
experiment (:mod:`nacre_lab.reproduce.textures.experiments`) is a view of that.
"""
