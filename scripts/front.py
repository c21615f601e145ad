"""The front of the site: the page of `nacre view` with all materials that come with nacre.

`python scripts/front.py FOLDER` writes `index.html`, which holds one kind of material, and a script
for each other kind, which the page loads when a reader asks for it. All of it opens from disk.
"""

from __future__ import annotations

import sys
from pathlib import Path

from built_from import built_from

import nacre
from nacre.included import Material
from nacre.io.files import atomic_path
from nacre.viewer.content import Content, Entry, own_environments

ROOT = Path(__file__).resolve().parents[1]
FIRST, OPENED = "rgl", "rgl:cc_ibiza_sunset"
"""The family of the page itself, and the material that it opens with."""
TITLES = {
    "rgl": "RGL, fitted by nacre",
    "merl": "MERL",
    "nbrdf-rgl": "RGL, of the NBRDF paper",
    "nielsen": "Nielsen",
    "captured": "Textures",
}
FILES = "materials"
WELCOME = (
    "Measured materials as small neural networks. Turn one in the light, or drop a measurement "
    "(MERL, RGL, MBSDF, CSV) on the page to see it and make it neural; it stays in your browser."
)
LINKS = {"Documentation": "docs/index.html", "Python API": "docs/api/index.html"}


def add(content: Content, materials: list[Material]) -> None:
    """Add included materials of one family, with the title of its shelf."""
    for material in materials:
        loaded = nacre.load(material.name)
        if isinstance(loaded, nacre.Btf):
            content.add_texture(loaded)
            continue
        facts = {"Name in nacre": material.name}
        group = TITLES[material.family.name]
        content.add(Entry(loaded.name or material.title, {"Network": loaded}, group, facts))


def write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path, internal=True) as temporary:
        temporary.write_bytes(content)
    print(f"{path}: {len(content):,} bytes", flush=True)


def main(folder: Path) -> None:
    """Write the page and its files."""
    families: dict[str, list[Material]] = {}
    for material in nacre.materials():
        families.setdefault(material.family.name, []).append(material)
    page, more = Content(own_environments(), code=True), []
    add(page, sorted(families.pop(FIRST), key=lambda material: material.name != OPENED))
    for name, materials in sorted(families.items(), key=lambda family: -len(family[1])):
        beside = page.beside(name)
        add(beside, materials)
        script = beside.script(name)
        place = f"{FILES}/{name}.js"
        write(folder / place, script)
        more.append(
            {
                "name": name,
                "title": TITLES[name],
                "about": materials[0].family.about,
                "count": len(materials),
                "size": f"{len(script) / 1e6:.1f} MB" if len(script) > 1e5 else "less than 0.1 MB",
                "src": place,
            }
        )
    notice = (ROOT / "src/nacre/included/NOTICE.txt").read_text("utf-8")
    welcome = f"{WELCOME} {built_from()}."
    page.facts |= {"more": more, "welcome": welcome, "links": LINKS, "notice": notice}
    write(folder / "index.html", page.page("nacre"))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]))
