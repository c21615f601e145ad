"""The tables and figures of "Unified Neural Encoding of BTFs", made again from any textures.

Codecs (:mod:`nacre.reproduce.btf.methods`) are found or trained once and kept as files, and so is
what they make of each texture (:mod:`nacre.reproduce.btf.study`); each experiment
(:mod:`nacre.reproduce.btf.experiments`) is a view of that.
"""
