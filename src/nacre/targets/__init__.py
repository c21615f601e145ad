"""Materials as code or data for other tools: one module per target."""

from nacre.targets.files import export
from nacre.targets.program import Function, program
from nacre.targets.target import TARGETS, Target
from nacre.targets.text import identifier, preamble, safe

__all__ = ["TARGETS", "Function", "Target", "export", "identifier", "preamble", "program", "safe"]
