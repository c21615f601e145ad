"""What a file is, how large, and whether anything is wrong with it: one sentence each."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nacre.brdf import COLOR, Brdf
from nacre.errors import in_words
from nacre.io.format import Format
from nacre.objects.described import readable_size

Sentences = tuple[str, ...]
"""What it is; how large; whether anything is wrong; and then notes about where it came from."""

_KINDS = {
    "codec": "A texture codec",
    "basis": "A latent basis",
    "code": "A code",
    "map": "A map of texels",
}
_PARTS = (  # facts that tell a size, and how to say them
    ("grid", "grid {}"),
    ("tensor tree", "tensor tree of {}"),
    ("samples", "{:,} samples"),
    ("bands", "{} bands"),
    ("layers", "layers of {} units"),
    ("materials in training", "made from {} materials"),
    ("code dim", "{} values a code"),
    ("latent size", "{} values a texel"),
    ("texels", "{:,} texels"),
    ("pairs of directions", "{:,} pairs of directions"),
)


def reflectance(
    facts: Mapping[str, Any], brdf: Brdf, entry: Format | None = None, file: str = "FILE"
) -> tuple[Sentences, bool]:
    """Sentences about a reflectance from its facts, and whether something looks wrong.

    `entry` is the format of its file, if it lies in one, and `file` the name of that.
    """
    from nacre.metrics.soundness import conclusion, findings

    isotropy = "isotropic" if brdf.isotropic else "anisotropic"
    formula = entry is not None and not entry.measured and "weights" not in facts
    if "weights" in facts:
        noun = "network"
    elif formula:
        noun = "analytic model"
    else:
        noun = "reflectance" if entry is None else "measured reflectance"
    what = f"An {isotropy} {noun}{_format(entry)}{_named(facts, file)}"
    fitted = facts.get("fitted to")
    if brdf.channels != COLOR:
        bands = dict.fromkeys(brdf.channels)
        plural = "s" if len(bands) > 1 else ""
        what += f", with the band{plural} {in_words(bands)} in place of colors"
    what += f", fitted to {fitted}." if fitted else "."
    size = _size(facts)
    if formula:
        size += f" {textwrap.shorten(brdf.summary(), 120, placeholder=' ...')}."
    if "energy" not in facts:
        unknown = "Energy and reciprocity were not computed."
        return (what, size, f"{unknown}{_quality(facts)}", *brdf.notes), False
    found = findings(facts, file, formula=formula)
    end = conclusion(found) + _quality(facts)
    return (what, size, end, *brdf.notes), any(one.wrong for one in found)


def texture(
    facts: Mapping[str, Any], entry: Format | None = None, file: str = "FILE"
) -> tuple[Sentences, bool]:
    """As :func:`reflectance`, about a texture."""
    kind = "An encoded" if "latent size" in facts else "A measured"
    what = f"{kind} texture{_format(entry)}{_named(facts, file)}."
    low, high = facts["value range"]
    mean = sum(facts["mean value"]) / 3.0
    values = f"from {low:.3g} to {high:.3g}, {mean:.3g} on average"
    seen = f"Its sampled values go {values} (white is 1)."
    if repeated := facts.get("pairs that repeat others"):
        seen += f" {repeated:,} pairs of directions repeat others."
    if mean > 1.0:
        hint = (
            " If its pixels are radiance, add --pixels radiance."
            if entry and entry.claims_folder
            else ""
        )
        return (what, _size(facts), f"Something looks wrong. {seen}{hint}"), True
    return (what, _size(facts), f"Nothing is wrong. {seen}{_loss(facts)}"), False


def other(kind: str, facts: Mapping[str, Any], file: str) -> Sentences:
    """About a file of nacre that holds no material; such a file is whole if it could be read."""
    of = f" ({facts['model']})" if "model" in facts else ""
    return f"{_KINDS[kind]}{of}{_named(facts, file)}.", _size(facts), "Nothing is wrong."


def sized(count: int) -> str:
    """Bytes for people: exact where that is short."""
    return f"{count:,} bytes" if count < 10_000 else readable_size(count)


def _format(entry: Format | None) -> str:
    """Its name, but for nacre's own."""
    return "" if entry is None or entry.name.startswith("nacre") else f" ({entry.name})"


def _named(facts: Mapping[str, Any], file: str) -> str:
    """The name, if it says more than that of the file."""
    name = facts.get("name") or facts.get("textures") or ""
    return "" if name in ("", Path(file).stem) else f": {name}"


def _size(facts: Mapping[str, Any]) -> str:
    parts = []
    weights, memory = facts.get("weights"), facts.get("memory bytes")
    if weights is not None:
        parts.append(f"{weights:,} weights{f' of {sized(memory)}' if memory else ''}")
    elif memory:
        parts.append(f"{sized(memory)} in memory")
    if "width" in facts:
        parts.append(f"{facts['width']:,} x {facts['height']:,} texels")
    parts += [
        words.format(facts[name]).removesuffix("s" * (facts[name] == 1))
        for name, words in _PARTS
        if facts.get(name) is not None
    ]
    if "bytes" in facts:
        size = f"The file has {sized(facts['bytes'])}"
        return f"{size}: {', '.join(parts)}." if parts else f"{size}."
    text = ", ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def _quality(facts: Mapping[str, Any]) -> str:
    """How close a network is to what it was fitted to, if its file says so."""
    names = ("environment psnr", "directional psnr")
    values = [facts[name] for name in names if isinstance(facts.get(name), float)]
    if len(values) < len(names):
        return ""
    from nacre.metrics.verdict import psnr_words

    shown = f"PSNR {values[0]:.1f} dB in an environment, {values[1]:.1f} dB in directional light"
    return f" Beside what it was fitted to: {shown}; {psnr_words(min(values))}."


def _loss(facts: Mapping[str, Any]) -> str:
    """How close an encoded texture is to what it was fitted to, if its file says so."""
    error = facts.get("MSE x 1e4")
    if not isinstance(error, float) or not error > 0.0:
        return ""
    return f" It matches what it was fitted to at PSNR {-10.0 * math.log10(1e-4 * error):.1f} dB."
