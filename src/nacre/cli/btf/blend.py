from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from nacre.cli import options
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.report import progress, report_file


@make(
    "blend",
    options.argument("first"),
    options.argument("second"),
    options.output_option("Encoded texture to write (.safetensors)."),
    option("--mask", default="right", metavar="right|down|noise|IMAGE"),
    "Place of SECOND: a named one, or white in a gray image (.png, .jpg), which is stretched.",
    options.texels_option(shown="the larger input's"),
    "Width and height of the output in texels.",
    option("--keep-contrast/--no-keep-contrast", default=True),
    "Restore the contrast that is lost in the middle between different textures.",
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
    """Blend two encoded textures with a mask, by averaging their codes.

    Both must come from the same codec. A texture smaller than the output repeats; if it does not
    tile, enlarge it with nacre btf synthesize first.
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
    reference = written_reference(mixed, first, output)
    save_latent_map(replace(mixed, reference=reference, metadata={"blend": facts}), output)
    fraction = float(fractions.mean())
    text = f"{width} x {height} texels, {100.0 * fraction:.1f} % {second.name}"
    report_file(output, text, width=width, height=height, second_fraction=fraction)
