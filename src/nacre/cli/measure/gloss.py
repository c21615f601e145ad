from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import alternatives, azimuth_options, note_band, note_known
from nacre.cli.report import print_table, progress, report, say
from nacre.errors import printable


@make(
    "gloss",
    options.argument("path", metavar="INPUT"),
    *azimuth_options(),
    writes=False,
    reads=True,
)
def command(path: Path, azimuth: float) -> None:
    """Read the specular gloss of a reflectance at 20, 60 and 85 degrees (ISO 2813, ASTM D523).

    In gloss units: polished black glass of index 1.567 reads 100.
    """
    import numpy as np

    from nacre.formats import load_brdf
    from nacre.instruments import gloss
    from nacre.instruments.glossmeter import ANGLES
    from nacre.latent.intervals import interval

    line = progress(path.stem, "reading")
    brdf = load_brdf(path)
    readings = []
    for index, angle in enumerate(ANGLES):
        line("measuring", index, len(ANGLES))
        readings.append(gloss(brdf, angle, azimuth=azimuth))
    others = [[gloss(o, a, azimuth=azimuth).value for a in ANGLES] for o in alternatives(brdf)]
    say(printable(path.resolve().name), style="bold")
    rows = [[f"{r.angle:g}", f"{r.value:.2f}", f"{r.known:.0%}"] for r in readings]
    columns = ["angle", "gloss, GU", "known"]
    data = [
        {"angle_deg": r.angle, "gloss_gu": r.value, "known_fraction": r.known} for r in readings
    ]
    if others:
        ends = np.maximum(interval(others), 0.0).T.tolist()
        columns.append("90 % within")
        for row, entry, (low, high) in zip(rows, data, ends, strict=True):
            row.append(f"{low:.2f} to {high:.2f}")
            entry |= {"gloss_low_gu": low, "gloss_high_gu": high}
    print_table(columns, rows)
    report([], {"file": str(path), "gloss": data})
    note_band(brdf)
    note_known(min(r.known for r in readings))
