"""MaterialX documents (`.mtlx`): reads one of their materials, writes OpenPBR."""

from nacre.standard.files.materialx.file import FORMAT, encode, load, save

__all__ = ["FORMAT", "encode", "load", "save"]
