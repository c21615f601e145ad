from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.instrument import instrument, instrument_options
from nacre.cli.options import option
from nacre.cli.predictions import facts, table
from nacre.cli.ranges import FiniteRange, IntRange
from nacre.cli.report import note, print_table, progress, report
from nacre.errors import FormatError, did_you_mean


def _instruments() -> Any:
    def parse(text: str) -> tuple[str, ...]:
        from nacre.instruments.readings import INSTRUMENTS

        names = tuple(name.strip() for name in text.split(","))
        for name in names:
            if name not in INSTRUMENTS:
                known = ", ".join(INSTRUMENTS)
                close = did_you_mean(name, INSTRUMENTS)
                raise ValueError(f"{name[:40]!r} is not one of {known}{close}")
        return names

    return options.Parsed("NAME,NAME", parse)


@make(
    "next",
    options.argument("source", metavar="INPUT"),
    options.output_option(
        "Table to write (.csv): the measured rows, then rows to fill in.",
        required=False,
        text=".csv",
    ),
    option("-n --count", IntRange(1, 64), default=4),
    "Largest number of pairs of directions, or pictures, to propose.",
    option("--budget", IntRange(1), shown="no limit"),
    "Total number of samples to measure.",
    option("--until", FiniteRange(0.0, 1.0), default=0.0),
    "Expected error to stop at, in a picture's display values from 0 to 1.",
    option("--instruments", _instruments(), metavar="NAME,NAME", shown="all but E2539"),
    "For readings: which instruments you have, of gloss, haze, E2194, E2539 (multi-angle), sphere "
    "and 45-0.",
    options.scale_option(),
    options.basis_option(),
    options.seed_option(),
    *instrument_options(),
    reads=True,
)
def command(
    source: Path,
    output: Path | None,
    count: int,
    budget: int | None,
    until: float,
    instruments: tuple[str, ...] | None,
    free_scale: bool,
    basis_name: str,
    seed: int,
    **chosen: Any,
) -> None:
    """Propose what to measure next, with expected values and their uncertainty.

    INPUT is a measurement at scattered directions: a plan with at least one row filled in. Or it
    is a table of readings (.csv): then the next readings are proposed.
    """
    from nacre.formats import load_brdf
    from nacre.instruments.readings_file import is_readings
    from nacre.latent import find_basis
    from nacre.latent.directions import check_isotropic
    from nacre.latent.hypernetwork import neural_basis
    from nacre.measured.comma_separated import save_plan
    from nacre.measured.scattered import ScatteredBrdf
    from nacre.measuring import propose

    if output is not None and output.suffix.lower() != ".csv":
        raise FormatError(f"{output}: a plan is a .csv file")
    options.check_outputs([output], [source, Path(basis_name)])
    if is_readings(source):
        own = ("budget", "free_scale", *chosen)
        if wrong := next((name for name in own if options.is_given(name)), None):
            option_name = wrong.replace("_", "-")
            raise click.UsageError(f"--{option_name} is for scattered directions, not for readings")
        _propose_readings(source, output, count, until, instruments, basis_name, seed)
        return
    if instruments is not None:
        raise click.UsageError(f"--instruments is for readings, and {source} holds none")
    reached = instrument(chosen)
    line = progress(source.stem, "reading")
    basis = neural_basis(find_basis(basis_name))
    measured = load_brdf(source)
    check_isotropic(measured)
    if not isinstance(measured, ScatteredBrdf):
        raise FormatError(f"{source}: is not a measurement at scattered directions")
    samples = measured.scattered().samples
    found = basis.posterior(samples, free_scale=free_scale)
    exposures = count if budget is None else min(count, max(0, budget - len(samples)))
    proposal = propose(
        basis, found, samples, reached, exposures, until=until, seed=seed, progress=line
    )
    rows, data = [], []
    for index in range(len(proposal.wi)):
        angles = _degrees(proposal.wi[index], proposal.wo[index])
        values = [v[index] for v in (proposal.expected, proposal.low, proposal.high)]
        middle, low, high = (float(np.mean(v)) for v in values)
        rows.append([f"{a:g}" for a in angles] + [f"{middle:.3g}", f"{low:.3g} to {high:.3g}"])
        keys = "theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"
        data.append(
            dict(zip(keys, angles, strict=True))
            | {
                name: v.tolist()
                for name, v in zip(
                    ("f_r_per_sr", "f_r_low_per_sr", "f_r_high_per_sr"), values, strict=True
                )
            }
        )
    if rows:
        columns = "theta_i", "phi_i", "theta_o", "phi_o", "f_r expected", "90 % within"
        print_table(columns, rows)
    if output is not None and rows:
        save_plan(proposal.wi, proposal.wo, output, name=measured.name, measured=measured)
    now, *later = (float(error) for error in proposal.errors)
    text = f"{source}: {len(samples)} samples, expected error {now:.4f}"
    if later:
        text += f", {later[-1]:.4f} after these"
    facts = {"samples": len(samples), "expected_error": now, "expected_error_after": later}
    written = str(output) if output is not None and rows else None
    report(text, {**facts, "pays": proposal.pays, "next": data, "output": written})
    if not later:
        reason = "the budget is spent" if exposures == 0 else f"the error is below {until:g}"
        note(f"nothing more is proposed: {reason}")
    elif not proposal.pays:
        note("another measurement no longer pays: it would lower the error by less than 1 %")


def _propose_readings(
    source: Path,
    output: Path | None,
    count: int,
    until: float,
    instruments: tuple[str, ...] | None,
    basis_name: str,
    seed: int,
) -> None:
    from nacre.instruments.readings import COMMON
    from nacre.instruments.readings_file import load_readings, save_readings
    from nacre.verbs.estimating import doubts, from_readings

    line = progress(source.stem, "reading")
    readings = load_readings(source)
    found = from_readings(readings, basis=basis_name, progress=line)
    now, proposals = found.propose(
        count, instruments=instruments or COMMON, until=until, seed=seed, progress=line
    )
    if proposals:
        columns, rows = table([], [each.prediction for each in proposals])
        errors = [f"{each.error:.4f}" for each in proposals]
        shown = [[*row[:2], *row[3:], error] for row, error in zip(rows, errors, strict=True)]
        print_table([*columns[:2], *columns[3:], "error after"], shown)
        if output is not None:
            quantities = [each.prediction.quantity for each in proposals]
            save_readings(readings, output, quantities)
    text = f"{source}: {len(found.readings)} readings, expected error {now:.4f}"
    if proposals:
        text += f", {proposals[-1].error:.4f} after these"
    data = {
        "readings": len(found.readings),
        "expected_error": now,
        "expected_error_after": [each.error for each in proposals],
        "next": [facts(each.prediction) for each in proposals],
        "doubtful": [reading.quantity.name for reading in found.doubtful],
        "output": str(output) if output is not None and proposals else None,
    }
    report(text, data)
    for doubt in doubts(found):
        note(doubt)
    if not proposals:
        reason = f"the error is below {until:g}" if now <= until else "all of them are taken"
        note(f"nothing more is proposed: {reason}")


def _degrees(wi: Any, wo: Any) -> tuple[float, ...]:
    from nacre.geometry import to_spherical

    angles = [angle for w in (wi, wo) for angle in to_spherical(tuple(w.astype(np.float64)))]
    return tuple(round(float(np.degrees(angle)), 4) + 0.0 for angle in angles)
