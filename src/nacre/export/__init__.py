"""Materials as code or data for other tools: one module per target."""

from nacre.export.files import export
from nacre.export.program import Function, program
from nacre.export.target import TARGETS, Target
from nacre.export.text import identifier, preamble, safe

__all__ = ["TARGETS", "Function", "Target", "export", "identifier", "preamble", "program", "safe"]
