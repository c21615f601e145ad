"""Fixtures of the rendering tests that tests of photographs use too."""

from tests.render.conftest import rgb

__all__ = ["rgb"]
