from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import progress, report_facts


@make(
    "recode",
    options.argument("source", metavar="CODES"),
    options.output_option("Encoded texture to write (.safetensors)."),
    options.bytes_per_texel_option(),
    options.quality_option(),
    option("--levels", IntRange(1, 12), metavar="N"),
    "Keep only the first levels of detail of a file that --bytes-per-texel or --quality wrote, "
    "which may be cut short after them.",
    option("--resume", is_flag=True, help="Resume the same command where it stopped."),
)
def command(
    source: Path,
    output: Path,
    bytes_per_texel: float | None,
    quality: float | None,
    levels: int | None,
    resume: bool,
) -> None:
    """Write an encoded texture in fewer bytes.

    Bytes are those of the codes; the codec comes on top unless it is a file beside. Fit the texture
    again where its measurements are at hand: from 4 bytes per texel on, that loses less.

    A stopped recoding keeps its state beside the output (OUTPUT.state), from which --resume
    continues.
    """
    from nacre.io.files import digest
    from nacre.metrics.texture_errors import UNITS
    from nacre.runtime.journal import Journal
    from nacre.runtime.store import Store
    from nacre.textures.latent_file import check_latent_path, load_latent_map, save_latent_map
    from nacre.textures.limit import Rate
    from nacre.workflows.rating import recoded

    given = [value for value in (bytes_per_texel, quality, levels) if value is not None]
    if len(given) != 1:
        raise click.UsageError("expected one of --bytes-per-texel, --quality, and --levels")
    check_latent_path(output)
    state = output.with_name(f"{output.name}.state")
    options.check_outputs([output], [source], [state])
    store = Store(state)
    store.check_wanted(resume)
    if levels is None:
        expect(source, "an encoded texture")
    began = time.monotonic()
    latent = load_latent_map(source, levels)
    facts, metadata = {}, {k: v for k, v in latent.metadata.items() if k != "errors"}
    if (rate := Rate.of(bytes_per_texel, quality)) is not None:
        store.fingerprint = f"{digest(source)} {rate}"
        with Journal(store) as journal:
            found = recoded(latent, rate, progress(output.stem), journal)
        latent, loss = found.latent, found.loss
        names = "MSE x 1e4", "relative RMSE"
        metadata = latent.metadata
        facts = {f"{name}, against the codes before": loss.facts()[name] for name in names}
    reference = written_reference(latent, source, output)
    metadata = metadata | {"recoded from": source_of(source)}
    latent = replace(latent, codes=latent.held, reference=reference, metadata=metadata)
    save_latent_map(latent, output)
    store.remove()
    height, width, _ = latent.shape
    rated = latent.rated
    shown = {
        "width": width,
        "height": height,
        **facts,
        "bytes per texel": rated.bytes_per_texel if rated else None,
        "seconds": time.monotonic() - began,
        "bytes of codes": rated.nbytes if rated else None,
        "bytes": output.stat().st_size,
    }
    report_facts(output.name, shown, UNITS, output=str(output))
