from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import azimuth_options, note_band, note_known
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
    from nacre.formats import load_brdf
    from nacre.instruments import gloss
    from nacre.instruments.glossmeter import ANGLES

    line = progress(path.stem, "reading")
    brdf = load_brdf(path)
    readings = []
    for index, angle in enumerate(ANGLES):
        line("measuring", index, len(ANGLES))
        readings.append(gloss(brdf, angle, azimuth=azimuth))
    say(printable(path.resolve().name), style="bold")
    rows = [[f"{r.angle:g}", f"{r.value:.2f}", f"{r.known:.0%}"] for r in readings]
    print_table(["angle", "gloss, GU", "known"], rows)
    data = [
        {"angle_deg": r.angle, "gloss_gu": r.value, "known_fraction": r.known} for r in readings
    ]
    report([], {"file": str(path), "gloss": data})
    note_band(brdf)
    note_known(min(r.known for r in readings))
