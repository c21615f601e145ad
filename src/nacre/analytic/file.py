"""Analytic materials as JSON: the name of the model and its parameters."""

from __future__ import annotations

import json
import reprlib
from pathlib import Path
from typing import Any

from nacre.analytic.catalog import MODELS
from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError, did_you_mean, reason
from nacre.io.files import check_json, read_bytes, write_encoded
from nacre.io.format import Format

VERSION = 1
_LIMIT = 1 << 20


def encode(brdf: AnalyticBrdf) -> bytes:
    """The content of an analytic material's file; every number is read back as it was.

    Raises FormatError if `brdf` is no analytic material, or the format cannot hold it.
    """
    if not isinstance(brdf, AnalyticBrdf):
        raise FormatError("holds analytic materials only; fit one with nacre fit --model")
    if MODELS.get(brdf.model) is not type(brdf):
        raise FormatError(
            f"cannot hold a {type(brdf).__name__}, which is not registered in "
            f"nacre.analytic.MODELS as {brdf.model!r}"
        )
    content = {
        "model": brdf.model,
        "version": VERSION,
        "name": brdf.name,
        "parameters": brdf.values,
        "metadata": brdf.metadata,
    }
    try:
        check_json(content)
        text = json.dumps(content, indent=1)
    except (TypeError, ValueError) as error:
        raise FormatError(f"metadata cannot be written as JSON: {error}") from error
    return (text + "\n").encode()


def save(brdf: AnalyticBrdf, path: Path) -> None:
    """Write an analytic material; raises FormatError as :func:`encode` does, or for a bad path."""
    write_encoded(path, encode, brdf)


def load(path: Path) -> AnalyticBrdf:
    """Read an analytic material; FormatError if its model or version is not known."""
    try:
        content = json.loads(read_bytes(path, _LIMIT).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not whole JSON: {error}") from error
    model = _field(path, content, "model", str)
    if model not in MODELS:
        hint = did_you_mean(model[:40], MODELS, f"known: {', '.join(MODELS)}")
        raise FormatError(f"{path}: model {model[:40]!r} is no known analytic model{hint}")
    if (version := content.get("version", VERSION)) != VERSION:
        raise FormatError(f"{path}: version {reprlib.repr(version)} is not {VERSION}; update nacre")
    values = _field(path, content, "parameters", dict)
    metadata = _field(path, content, "metadata", dict) if "metadata" in content else {}
    name = _field(path, content, "name", str) if "name" in content else ""
    for part in ("fit", "source"):
        if not isinstance(metadata.get(part, {}), dict):
            raise FormatError(f"{path}: metadata field {part!r} is not an object")
    try:
        brdf = MODELS[model](name=name, metadata=metadata, **values)
    except (ValueError, TypeError, OverflowError) as error:
        raise FormatError(f"{path}: parameters: {error}") from error
    try:
        check_json(content)
    except ValueError as error:
        raise FormatError(f"{path}: could not be written again: {reason(error)}") from error
    return brdf


def _field(path: Path, content: Any, name: str, kind: type[str] | type[dict[str, Any]]) -> Any:
    value = content.get(name) if isinstance(content, dict) else None
    if not isinstance(value, kind):
        raise FormatError(
            f"{path}: field {name!r} is not {'a string' if kind is str else 'an object'}"
        )
    return value


FORMAT = Format(
    "analytic",
    (".json",),
    lambda head: head.lstrip().startswith(b"{") and b'"model"' in head,
    load,
    save,
    holds="analytic",
    measured=False,
)
