"""The open benchmark: fixed materials, one protocol, every representation, one line per result.

:mod:`nacre_lab.benchmark.splits` has the materials, :mod:`nacre_lab.benchmark.protocol` the
measurements, :mod:`nacre_lab.benchmark.methods` nacre's representations. Other packages add theirs
through entry points in the group `nacre.methods`.
"""

from nacre.registry import Registry
from nacre_lab.reproduce.trial import Method

METHODS: Registry[Method] = Registry("nacre.methods", "method", {}, base=Method)
"""Methods from other packages, by name; those of nacre are made for each run."""

__all__ = ["METHODS", "Method"]
