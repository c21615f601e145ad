"""`nacre btf blend`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.console import check_outputs, console, file_path
from nacre.cli.ranges import SEED


@click.command("blend")
@click.argument("first", type=file_path())
@click.argument("second", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File (.safetensors).")
@click.option(
    "--mask",
    default="right",
    show_default=True,
    metavar="right|down|noise|PATH",
    help="Where SECOND is: white in an image (.png, .jpg) of grays, which is stretched.",
)
@click.option(
    "--size",
    nargs=2,
    type=click.IntRange(1),
    metavar="W H",
    help="Texels of the output.  [default: those of the larger one]",
)
@click.option(
    "--keep-contrast/--mean",
    default=True,
    help="Whether the middle gets back the contrast that means of unlike textures lose.",
)
@click.option("--seed", default=0, type=SEED, help="Of noise.")
def command(
    first: Path,
    second: Path,
    output: Path,
    mask: str,
    size: tuple[int, int] | None,
    keep_contrast: bool,
    seed: int,
) -> None:
    """Mix the encoded textures FIRST and SECOND by a mask, as means of their codes.

    Both must have been encoded by the same model. One that is smaller than the output repeats: if
    it does not tile, make it larger by nacre btf synthesize first.
    """
    from nacre.textures.latent_file import check_latent_path, load_latent_map, save_latent_map
    from nacre.textures.synthesis import blend
    from nacre.textures.synthesis.blending import NAMED, named_mask

    check_latent_path(output)
    check_outputs([output], [first, second, *([] if mask in NAMED else [Path(mask)])])
    for path in (first, second):
        expect(path, "an encoded texture")
    maps = [load_latent_map(path) for path in (first, second)]
    width, height = size or (max(m.codes.shape[axis] for m in maps) for axis in (1, 0))
    shares = named_mask(mask, height, width, seed)
    mixed = blend(*maps, shares, keep_contrast=keep_contrast)
    facts = {
        "sources": [source_of(path) for path in (first, second)],
        "mask": mask if mask in NAMED else source_of(Path(mask)),
        "contrast kept": keep_contrast,
        "seed": seed,
    }
    reference = written_reference(maps[0], first, output)
    save_latent_map(replace(mixed, reference=reference, metadata={"blend": facts}), output)
    share = 100.0 * float(shares.mean())
    console.print(f"{output}: {width} x {height} texels, {share:.1f} % {second.name}", markup=False)
