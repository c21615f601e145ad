from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import azimuth_options, note_band, note_known
from nacre.cli.report import print_facts, print_json, progress


@make(
    "haze",
    options.argument("path", metavar="INPUT"),
    *azimuth_options(),
    writes=False,
    reads=True,
)
def command(path: Path, azimuth: float) -> None:
    """Read the reflection haze of a reflectance at 20 degrees (ISO 13803, ASTM E430).

    Light 2 degrees beside the mirror direction, in percent of what black glass mirrors; also on the
    logarithmic scale, and without diffuse light.
    """
    from nacre.formats import load_brdf
    from nacre.instruments import haze

    line = progress(path.stem, "reading")
    brdf = load_brdf(path)
    line("measuring", 0, 1)
    found = haze(brdf, azimuth=azimuth)
    facts = {
        "haze": found.value,
        "log haze": found.log,
        "compensated haze": found.compensated,
        "gloss at 20 degrees": found.gloss,
    }
    units = dict.fromkeys(facts, "HU") | {"gloss at 20 degrees": "GU", "log haze": "HU, log"}
    print_facts(path.resolve().name, [(k, f"{v:.2f}") for k, v in facts.items()], units)
    print_json(
        {
            "file": str(path),
            "haze_hu": found.value,
            "log_haze_hu": found.log,
            "compensated_haze_hu": found.compensated,
            "gloss_20_gu": found.gloss,
            "known_fraction": found.known,
        }
    )
    note_band(brdf)
    note_known(found.known)
