"""Parametric standards from other tools, and mixtures of their closures, as analytic models."""

from nacre.standard.fitted import fitted

__all__ = ["fitted"]
