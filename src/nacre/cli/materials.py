from __future__ import annotations

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.report import print_json, print_table, say
from nacre.errors import NacreError


@make("materials", options.argument("words", None, nargs=-1, metavar="WORD..."), writes=False)
def command(words: tuple[str, ...]) -> None:
    """List the materials that come with nacre, whose names all commands take in place of a file.

    With WORDs, list those whose name or title has all of them, such as 'rgl:' or 'gold'. The error
    is the PSNR of rendered spheres against the measurement, in an environment and in directional
    light, and for textures of all reflectance factors; it is unknown where we could not compare.
    'nacre info NAME' shows a material's source and terms.
    """
    from nacre.included import materials

    found = materials(*words)
    if not found:
        raise NacreError(f"no material that comes with nacre has {' and '.join(words)} in its name")
    print_json(
        [
            {
                "name": each.name,
                "title": each.title,
                "kind": each.kind,
                "size_bytes": each.nbytes,
                "psnr_db": dict(each.psnr),
                "about": each.family.about,
                "source": each.family.source,
                "terms": each.family.terms,
            }
            for each in found
        ]
    )
    rows = [(m.name, m.nbytes, " / ".join(map(str, m.psnr.values())) or None) for m in found]
    print_table(("name", "bytes", "PSNR (dB)"), rows)
    for family in {each.family.name: each.family for each in found}.values():
        say(f"{family.name}: {family.about} {family.terms}")
