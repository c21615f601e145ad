"""Facts that files of other tools keep about a material beside its parameters."""

from __future__ import annotations

import json
import re
from typing import Any

from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError, printable, reason
from nacre.io.files import check_json

FACTS = "nacre"
"""Name of the entry for :func:`facts_of` in a file."""

_FACT_KEYS = "name", "metadata", "notes"


def facts_of(brdf: AnalyticBrdf) -> str:
    """Name, metadata and notes of a material as JSON, for tools that keep unknown entries.

    Raises FormatError if the metadata cannot be written.
    """
    facts: dict[str, Any] = {"name": brdf.name, "metadata": brdf.metadata}
    if brdf.notes:
        facts["notes"] = list(brdf.notes)
    try:
        check_json(facts)
        return json.dumps(facts)
    except (TypeError, ValueError) as error:
        raise FormatError(f"metadata cannot be written as JSON: {error}") from error


def parsed_facts(text: str | None) -> tuple[str, dict[str, Any], tuple[str, ...]]:
    """Name, metadata and notes from :func:`facts_of`, empty if a file has no such text.

    Raises FormatError if the text is not from there.
    """
    if text is None:
        return "", {}, ()
    try:
        facts = json.loads(text)
        check_json(facts)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{FACTS!r} is not whole JSON: {reason(error)}") from error
    name, metadata, notes = (facts.get(k) if isinstance(facts, dict) else None for k in _FACT_KEYS)
    parts = [metadata.get(k, {}) for k in ("fit", "source")] if isinstance(metadata, dict) else [0]
    notes = [] if notes is None else notes
    texts = isinstance(notes, list) and all(isinstance(note, str) for note in notes)
    if isinstance(name, str) and texts and all(isinstance(part, dict) for part in parts):
        return name, dict(metadata or {}), tuple(notes)
    raise FormatError(f"{FACTS!r} is not what nacre writes; remove it")


def node_name(name: str) -> str:
    """A name for MaterialX and USD: ASCII letters, digits and _, no digit first.

    >>> node_name("2 coats")
    'm_2_coats'
    """
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name)[:60].strip("_")
    return plain if plain[:1].isalpha() else f"m_{plain}" if plain else "material"


def about(brdf: AnalyticBrdf) -> str:
    """What a file tells people about its material: its source, notes, and terms of the source."""
    known = brdf.describe()
    parts = []
    if "fitted to" in known:
        parts.append(f"Fitted to {known['fitted to']}, SHA-256 {known.get('fitted to sha256')}.")
    given = brdf.source or {}
    terms = given.get("terms") or known.get("terms of the source") or "not recorded"
    return printable(" ".join([*parts, *brdf.notes, f"Terms of the source: {terms}"]))
