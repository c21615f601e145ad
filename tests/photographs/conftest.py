"""Fixtures of the rendering tests that tests of photographs use too."""

from tests.mitsuba.conftest import rgb

__all__ = ["rgb"]
