"""The open benchmark: fixed materials, one protocol, every representation, a line a result.

:mod:`nacre_lab.benchmark.splits` has the materials, :mod:`nacre_lab.benchmark.protocol` what is
measured of each, :mod:`nacre_lab.benchmark.methods` nacre's representations. Other packages bring
theirs by entry points of the group `nacre.methods`.
"""

from nacre.registry import Registry
from nacre_lab.reproduce.trial import Method

METHODS: Registry[Method] = Registry("nacre.methods", "method", {}, base=Method)
"""Methods that other packages bring, by name; those of nacre are made for each run."""

__all__ = ["METHODS", "Method"]
