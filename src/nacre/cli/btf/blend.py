"""`nacre btf blend`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from nacre.cli import options
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import report_file


@make(
    "blend",
    options.argument("first"),
    options.argument("second"),
    options.output_option("Encoded texture to write (.safetensors)."),
    option("--mask", default="right", metavar="right|down|noise|IMAGE"),
    "Place of SECOND: white in a gray image (.png, .jpg), which is stretched.",
    options.texels_option(shown="those of the larger one"),
    "Width and height of the output in texels.",
    option("--keep-contrast/--no-keep-contrast", default=True),
    "Restore in the middle the contrast that means of unlike textures lose.",
    options.seed_option(),
)
def command(
    first: Path,
    second: Path,
    output: Path,
    mask: str,
    texels: tuple[int, int] | None,
    keep_contrast: bool,
    seed: int,
) -> None:
    """Mix two encoded textures by a mask, as means of their codes.

    Both must have been encoded by the same codec. One that is smaller than the output repeats: if
    it does not tile, make it larger by nacre btf synthesize first.
    """
    from nacre.textures.latent_file import check_latent_path, load_latent_map, save_latent_map
    from nacre.textures.synthesis import blend
    from nacre.textures.synthesis.blending import NAMED, named_mask

    check_latent_path(output)
    options.check_outputs([output], [first, second, None if mask in NAMED else Path(mask)])
    progress(output.stem, "blending")
    for path in (first, second):
        expect(path, "an encoded texture")
    maps = [load_latent_map(path) for path in (first, second)]
    width, height = texels or (max(m.codes.shape[axis] for m in maps) for axis in (1, 0))
    fractions = named_mask(mask, height, width, seed)
    mixed = blend(*maps, fractions, keep_contrast=keep_contrast)
    facts = {
        "sources": [source_of(path) for path in (first, second)],
        "mask": mask if mask in NAMED else source_of(Path(mask)),
        "contrast kept": keep_contrast,
        "seed": seed,
    }
    reference = written_reference(maps[0], first, output)
    save_latent_map(replace(mixed, reference=reference, metadata={"blend": facts}), output)
    fraction = float(fractions.mean())
    text = f"{width} x {height} texels, {100.0 * fraction:.1f} % {second.name}"
    report_file(output, text, width=width, height=height, second_fraction=fraction)
