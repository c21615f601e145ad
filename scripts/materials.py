"""Print docs/reference/materials.md, made of the files of the materials that come with nacre.

`python scripts/materials.py > docs/reference/materials.md`
"""

from __future__ import annotations

import nacre
from nacre.included import Family, Material, families

HEAD = """\
# Materials that come with nacre

`nacre render rgl:paper_white`, `nacre.load("merl:chrome")`: every command, `nacre.load` and the
Mitsuba plugins take these names in place of a file, and nothing is downloaded. A file of that name
comes first. `nacre materials` lists them, `nacre materials gold` those with a word in their name,
`nacre info NAME` shows one. In Python, `nacre.materials()`.

A family has one source and one license. `rgl` has nacre's own fits, and `nbrdf-rgl` the networks
that the authors of the paper published, so a material of the RGL database may be in both; `merl`
and `nielsen` are published networks, too. Names are those of `nacre download rgl` and `nacre
download merl`, which get the measurements. The latent basis that comes with nacre was trained on
120 of the published networks: it has a code of 32 numbers for each, a coarser form of the same
material that has no name here.

The error is the PSNR of spheres to the measurement, in the built-in environment and in directional
light, as `nacre compare` has it ([how](measures.md)); of textures, that of all reflectance factors
for a peak of 1, white. It is unknown where we could not compare with the measurement. *Rounding* is
the PSNR of spheres between a published network as it is here, in half precision, and as it was
published: the lower of both lights, of the environment 64 directions.

`make included NACRE_DATA=FOLDER` makes the files of the measurements and the published networks;
this page is made of them by `python scripts/materials.py`.
"""


def page() -> str:
    """The whole page."""
    known = nacre.materials()
    total = sum(material.nbytes for material in known)
    count = f"{len(known)} materials, {total:,} bytes in all.\n"
    sections = [section(f, [m for m in known if m.family == f]) for f in families().values()]
    return "\n".join([HEAD, count, *sections])


def section(family: Family, members: list[Material]) -> str:
    """One family as a table."""
    facts = [f"{family.about} Source: {family.source} Terms: {family.terms}"]
    rounded = any(member.rounding for member in members)
    columns = ["name", "", "bytes", "PSNR (dB)", *["rounding (dB)"] * rounded]
    lines = [f"| {' | '.join(columns)} |", f"|---|---|{'---:|' * (len(columns) - 2)}"]
    for member in members:
        stem = member.name.partition(":")[2]
        title = member.title if member.title != stem else ""
        error = " / ".join(map(str, member.psnr.values())) or "unknown"
        cells = [
            f"`{member.name}`",
            title,
            f"{member.nbytes:,}",
            error,
            *[f"{member.rounding}"] * rounded,
        ]
        lines.append(f"| {' | '.join(cells)} |".replace("|  |", "| |"))
    return "\n".join([f"## {family.name}", "", *facts, "", *lines, ""])


if __name__ == "__main__":
    print(page(), end="")
