from __future__ import annotations

from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.predictions import facts, table
from nacre.cli.report import keyed, note, print_table, progress, report_file
from nacre.errors import FormatError

_GROUP = "photographs"


@make(
    "estimate",
    options.argument(
        "photographs", options.INPUT, nargs=-1, required=False, metavar="[PHOTOGRAPH...]"
    ),
    options.output_option("Network (.safetensors) or code (.json) to write."),
    option("--readings", options.INPUT, metavar="FILE"),
    "Readings of glossmeters and other instruments (.csv), in place of photographs.",
    option("--scene", options.INPUT, metavar="FILE", group=_GROUP),
    "Mitsuba scene (.xml) that was photographed, with one camera or one for each photograph.",
    option("--bsdf name", metavar="ID", group=_GROUP),
    "BSDF in the scene to estimate.",
    option("--geometry", ["sphere"], group=_GROUP),
    "Object to use instead of a scene: a distant sphere with a margin of 3 % of the picture.",
    options.environment_option(shown=None, group=_GROUP),
    "Latitude-longitude map (.exr, .hdr) that lights the object.",
    option("--camera", ["known", "exposure", "white-balance"], default="known", group=_GROUP),
    "Calibration of the cameras: known; unknown exposure; or unknown exposure and white balance.",
    options.basis_option(),
    options.seed_option(),
)
def command(
    photographs: tuple[Path, ...],
    output: Path,
    readings: Path | None,
    scene: Path | None,
    name: str | None,
    geometry: str | None,
    environment: Path | None,
    camera: str,
    basis_name: str,
    seed: int,
) -> None:
    """Estimate an isotropic material from photographs in known light, or from readings.

    One to eight PHOTOGRAPHs are OpenEXR pictures with linear values, in the same unit as the light.
    Run the same command again to resume a stopped estimate.
    """
    from nacre.io.files import remove_file
    from nacre.latent import find_basis, save_code
    from nacre.latent.estimates import in_words
    from nacre.verbs.estimating import DOUBTFUL, photographed

    if output.suffix.lower() not in (".safetensors", ".json"):
        raise FormatError(f"{output}: an estimate is a .safetensors or a .json file")
    if readings is not None:
        if photographs or scene or name or geometry or environment or camera != "known":
            raise click.UsageError("--readings takes the place of photographs and of their light")
        options.check_outputs([output], [readings, Path(basis_name)])
        _estimate_from_readings(readings, output, basis_name)
        return
    if not photographs:
        raise click.UsageError("name the photographs, or give --readings")
    if (scene is None) == (geometry is None):
        raise click.UsageError("say what was photographed, with --scene or --geometry")
    if scene is not None and (name is None or environment is not None):
        raise click.UsageError("--scene needs --bsdf, and has its own light")
    if geometry is not None and (environment is None or name is not None):
        raise click.UsageError("--geometry needs --environment, and has one material")
    options.check_outputs([output], [*photographs, scene, environment, Path(basis_name)])
    line = progress(output.stem, "reading")
    state = output.with_name(f"{output.name}.state")
    found = photographed(
        photographs,
        scene=scene,
        bsdf=name,
        geometry=geometry,
        environment=environment,
        camera=camera,
        basis=basis_name,
        name=output.stem,
        seed=seed,
        state=state,
        progress=line,
    )
    known = found.estimate.facts()
    if output.suffix.lower() == ".json":
        code = found.estimate.material.code
        save_code(find_basis(basis_name).decode(code, output.stem), output)
    else:
        from nacre.formats import save

        save(found.network(seed=seed, progress=line), output)
    remove_file(state)
    text = f"pixels within {found.unexplained:.1%} in the median{in_words(known)}"
    factors = found.factors.tolist() if camera != "known" else None
    report_file(
        output,
        text,
        unexplained=found.unexplained,
        camera_factors=factors,
        rounds=found.rounds,
        **keyed(known),
    )
    if factors:
        for path, factor in zip(photographs, factors, strict=True):
            note(f"{path}: camera factor {' '.join(f'{value:.3f}' for value in factor)}")
    if found.unexplained > DOUBTFUL:
        note(
            "no material explains the photographs: check the scene, the light and its unit, and "
            "--camera"
        )


def _estimate_from_readings(path: Path, output: Path, basis_name: str) -> None:
    from nacre.formats import save
    from nacre.latent import save_code
    from nacre.latent.estimates import in_words
    from nacre.verbs.estimating import doubts, from_readings

    line = progress(output.stem, "reading")
    found = from_readings(path, basis=basis_name, name=output.stem, progress=line)
    known = found.estimate.facts()
    predictions = found.predictions(line)
    error, proposals = found.propose(progress=line)
    if output.suffix.lower() == ".json":
        save_code(found.estimate.material, output)
    else:
        save(found.network(progress=line), output)
    print_table(*table(found.readings, predictions))
    within = dict(found.known_within())
    proposal = proposals[0] if proposals else None
    report_file(
        output,
        f"readings within {found.unexplained:.1%} in the median{in_words(known)}",
        unexplained=found.unexplained,
        **keyed(known),
        f_r_within_a_factor=keyed(within),
        expected_error=error,
        doubtful=[reading.quantity.name for reading in found.doubtful],
        predictions=[facts(prediction) for prediction in predictions],
        next=None if proposal is None else facts(proposal.prediction) | {"error": proposal.error},
    )
    parts = ", ".join(f"{factor:.2f} {where}" for where, factor in within.items())
    note(f"f_r is known within a factor of {parts}")
    if proposal is not None:
        quantity = proposal.prediction.quantity.name
        note(
            f"next, {quantity} would tell most: the expected error of pictures would fall from "
            f"{error:.4f} to {proposal.error:.4f}"
        )
    for doubt in doubts(found):
        note(doubt)
