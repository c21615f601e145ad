"""The tables and figures of "Unified Neural Encoding of BTFs", reproduced from any textures.

Codecs (:mod:`nacre_lab.reproduce.textures.methods`) are found or trained once and kept as files, as
are their results on each texture (:mod:`nacre_lab.reproduce.textures.study`); each experiment
(:mod:`nacre_lab.reproduce.textures.experiments`) is a view of these.
"""
