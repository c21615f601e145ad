"""Print docs/reference/materials.md, made of the files of the materials that come with nacre.

`python scripts/materials.py > docs/reference/materials.md`
"""

from __future__ import annotations

import nacre
from nacre.included import Family, Material, families

HEAD = """\
# Materials that come with nacre

Every command, `nacre.load` and the Mitsuba plugins take these names in place of a file, as in
`nacre render rgl:paper_white`; nothing is downloaded. A file with that name comes first.
`nacre materials gold` lists the names with a word in them, `nacre info NAME` shows one; in Python,
`nacre.materials()`. `nacre download rgl` and `nacre download merl` get the measurements.

PSNR (dB) is that of spheres against the measurement, in the built-in environment and in
directional light, as in `nacre compare` ([measures](measures.md)); for textures, that of all
reflectance factors with a peak of 1. It is unknown where the measurement could not be compared.
*Rounding* is the PSNR (dB) of spheres between a published network in half precision, as it is here,
and as it was published: the lower of both lights, the environment with 64 directions.

`make included NACRE_DATA=FOLDER` makes the files from the measurements and the published networks;
`python scripts/materials.py` writes this page.
"""


def page() -> str:
    """The whole page."""
    known = nacre.materials()
    total = sum(material.nbytes for material in known)
    count = f"{len(known)} materials, {total:,} bytes in all.\n"
    sections = [section(f, [m for m in known if m.family == f]) for f in families().values()]
    return "\n".join([HEAD, count, *sections])


def section(family: Family, members: list[Material]) -> str:
    """One family: a table of those that were compared with a measurement, a list of the others."""
    rights = family.source, family.terms
    first = next(other for other in families().values() if (other.source, other.terms) == rights)
    known = f"Source: {family.source} Terms: {family.terms}"
    if first.name != family.name:
        known = f"Source and terms: as `{first.name}`."
    sizes = [member.nbytes for member in members]
    size = f"Files of {min(sizes):,} to {max(sizes):,} bytes."
    text = [f"## {family.name}", "", f"{family.about} {known} {size}"]
    judged = [member for member in members if member.psnr]
    if judged:
        text += ["", *table(judged)]
    others = [member for member in members if not member.psnr]
    if others:
        stems = ", ".join(f"`{stem(member)}`" for member in others)
        rounding = [member.rounding for member in others if member.rounding is not None]
        said = f", rounding {min(rounding)} to {max(rounding)} dB" if rounding else ""
        text += ["", f"{len(others)} with unknown PSNR{said}, as `{family.name}:NAME`: {stems}."]
    return "\n".join([*text, ""])


def table(members: list[Material]) -> list[str]:
    """Lines of a table with a row for each material."""
    rounded = any(member.rounding is not None for member in members)
    titled = any(member.title != stem(member) for member in members)
    columns = ["name", *["title"] * titled, "PSNR", *["rounding"] * rounded]
    lines = [f"| {' | '.join(columns)} |", f"|---|{'---|' * titled}{'---:|' * (1 + rounded)}"]
    for member in members:
        error = " / ".join(map(str, member.psnr.values()))
        cells = [f"`{member.name}`", *[member.title] * titled, error]
        cells += [f"{member.rounding}"] * rounded
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def stem(member: Material) -> str:
    """What stands after the colon of a name."""
    return member.name.partition(":")[2]


if __name__ == "__main__":
    print(page(), end="")
