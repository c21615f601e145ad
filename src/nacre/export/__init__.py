"""Materials as code or data of other tools: one module a target."""

from nacre.export.target import TARGETS, Target

__all__ = ["TARGETS", "Target"]
