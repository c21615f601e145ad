from __future__ import annotations

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.report import counted, print_json, print_table, report, say

NAMES = "code", "kernels", "downloads"


@make(
    "cache",
    options.argument("action", click.Choice(["list", "clear"]), required=False, default="list"),
    options.argument("names", click.Choice(NAMES), nargs=-1, metavar="[NAME]..."),
    writes=False,
)
def command(action: str, names: tuple[str, ...]) -> None:
    """List what nacre keeps on this machine, with places and sizes, or clear it.

    NAMEs are code, kernels and downloads; all are listed by default. 'nacre cache clear' empties
    code and kernels, which are made again when they are needed; name downloads to remove these too.
    Files that you put among downloads, or changed, stay.
    """
    from nacre.objects.described import readable_size
    from nacre.workflows.caches import caches

    if action == "clear" and not names:
        names = tuple(name for name, cache in caches().items() if cache.remade)
    chosen = [cache for name, cache in caches().items() if not names or name in names]
    if action == "clear":
        lines, facts = [], []
        for cache in chosen:
            count, size = cache.clear()
            done = "nothing to remove in"
            if count:
                done = f"removed {counted(count, 'file', 'files')}, {readable_size(size)}, from"
            lines.append(f"{cache.name}: {done} {cache.folder}")
            facts.append({"cache": cache.name, "removed_files": count, "removed_bytes": size})
        report(lines, facts)
        return
    sizes = [(cache, *cache.size()) for cache in chosen]
    print_json(
        [
            {
                "cache": cache.name,
                "about": cache.about,
                "folder": str(cache.folder),
                "files": count,
                "size_bytes": size,
            }
            for cache, count, size in sizes
        ]
    )
    rows = [(cache.name, count, readable_size(size)) for cache, count, size in sizes]
    print_table(("cache", "files", "size"), rows)
    for cache in chosen:
        say(f"{cache.name}: {cache.about}; in {cache.folder}")
    say("To empty code and kernels: nacre cache clear")
    say("To remove downloads: nacre cache clear downloads")
