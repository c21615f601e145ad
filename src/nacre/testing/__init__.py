"""Contracts that members of each family keep, for tests of packages that extend nacre.

Each `check_…` gives pairs of a name and a function that raises AssertionError where the contract is
broken; :func:`parametrize` makes tests for pytest from them:

    import nacre.testing
    from my_package import MyModel

    @nacre.testing.parametrize(nacre.testing.check_model(MyModel))
    def test_my_model(check):
        check()

pytest is imported by :func:`parametrize` only. A check that needs a library that is not installed
raises :class:`unittest.SkipTest`, which pytest counts as skipped.
"""

from nacre.testing.brdf import check_brdf
from nacre.testing.cases import Check, Checks, parametrize
from nacre.testing.codec import check_codec
from nacre.testing.format import check_format
from nacre.testing.model import check_model
from nacre.testing.sampler import check_sampler
from nacre.testing.target import check_target

__all__ = [
    "Check",
    "Checks",
    "check_brdf",
    "check_codec",
    "check_format",
    "check_model",
    "check_sampler",
    "check_target",
    "parametrize",
]
