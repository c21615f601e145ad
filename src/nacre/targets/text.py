"""Text about materials in other languages: identifiers, and the head of an output."""

from __future__ import annotations

import math
import re
import string
import unicodedata
from collections.abc import Iterable

import numpy as np

from nacre.brdf import COLOR, Brdf
from nacre.btf import Btf

_MAX_NAME = 60
_SAFE = frozenset(string.ascii_letters + string.digits + " .,:;()+-_=%")
"""Characters that cannot end a comment or a string in any language."""


def identifier(name: str) -> str:
    """A name as an identifier of every language: lower-case ASCII letters, digits and single _.

    It begins with a letter and does not end with _, so that _eval may follow.

    Examples
    --------
    >>> identifier("TeckWrap vinyl (Rosaline Satin CK904)")
    'teckwrap_vinyl_rosaline_satin_ck904'
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    joined = re.sub(r"[^a-z0-9]+", "_", plain)[:_MAX_NAME].strip("_")
    if not joined:
        return "material"
    return joined if joined[0].isalpha() and not joined.startswith("gl_") else f"m_{joined}"


def safe(text: str) -> str:
    r"""Text of a file as a comment or string of any language holds it: on one line, plain ASCII.

    Examples
    --------
    >>> safe('*/ system("ls") --> \\')
    '__ system(_ls_) -_ _'
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "replace").decode()
    kept = "".join(c if c in _SAFE else "_" for c in plain)
    return re.sub(r"-{2,}", "-", kept)[:200]


def shortest(number: np.float32) -> str:
    """The fewest digits that parse to the same number, whatever NumPy's print options."""
    if not math.isfinite(number):
        return str(float(number))
    if number == 0.0 or 1e-4 <= abs(number) < 1e16:
        return np.format_float_positional(number, trim="0")
    return np.format_float_scientific(number, trim="-")


CONVENTIONS = (
    "f_r in 1/sr, linear Rec. 709 RGB, without the cosine; 0 below the horizon.",
    "Local frame: z is the normal. wi points to the light, wo to the viewer, both away from the",
    "surface and of unit length. u: three random numbers in [0, 1). pdf: density of wi over solid",
    "angle for a given wo; 0 where a sample is to be discarded.",
)


def facts(material: Brdf | Btf) -> dict[str, str]:
    """What an output says about its material, one line each: model, source, size, error, terms."""
    known = material.describe()
    found = {"material": f"{safe(material.name) or 'A material'}; written by nacre export"}
    sizes = [safe(f"{known[key]} {key}") for key in ("weights", "memory bytes") if key in known]
    model = safe(str(known.get("model", "")))
    if isinstance(material, Btf):
        model = f"Texture of {material.width} x {material.height} texels"
    found["model"] = ", ".join([model, *sizes])
    given = material.source or {}
    if "fitted to" in known:
        source = safe(str(known["fitted to"]))
        found["source"] = f"Fitted to {source}, SHA-256 {safe(str(known.get('fitted to sha256')))}"
    loss = known.get("held out loss")
    if isinstance(loss, float):
        scale = f" ({safe(str(known['loss']))})" if "loss" in known else ""
        found["error"] = f"Error against it: held-out loss {loss:.5f}{scale}"
    if isinstance(material, Brdf) and material.channels != COLOR:
        found["channels"] = (
            f"Channels, in place of red, green and blue: {_listed(material.channels)}"
        )
    if isinstance(material, Brdf) and material.notes:
        found["notes"] = f"Notes: {_listed(material.notes, ' ')}"
    terms = given.get("terms") or known.get("terms of the source") or "not recorded"
    return found | {"terms": f"Terms of the source: {safe(str(terms))}"}


def _listed(texts: Iterable[str], between: str = ", ") -> str:
    return between.join(map(safe, texts))


def preamble(material: Brdf | Btf) -> list[str]:
    """The first lines of an output: facts about its material, and conventions."""
    return [*facts(material).values(), "", *CONVENTIONS]
