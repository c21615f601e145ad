from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import alternatives, azimuth_options, note_band, note_known
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
    from nacre.latent.intervals import interval

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
    read = [haze(each, azimuth=azimuth) for each in alternatives(brdf)]
    ends = interval([[r.value, r.log, r.compensated, r.gloss] for r in read]) if read else ()
    units = dict.fromkeys(facts, "HU") | {"gloss at 20 degrees": "GU", "log haze": "HU, log"}
    shown = {name: f"{value:.2f}" for name, value in facts.items()}
    if read:
        for name, low, high in zip(facts, *ends, strict=True):
            shown[name] += f" ({max(low, 0.0):.2f} to {high:.2f} for 90 %)"
    print_facts(path.resolve().name, list(shown.items()), units)
    keys = "haze_hu", "log_haze_hu", "compensated_haze_hu", "gloss_20_gu"
    spread = {
        f"{key}_{side}": value
        for side, end in zip(("low", "high"), ends, strict=False)
        for key, value in zip(keys, end.tolist(), strict=True)
    }
    print_json(
        {
            "file": str(path),
            "haze_hu": found.value,
            "log_haze_hu": found.log,
            "compensated_haze_hu": found.compensated,
            "gloss_20_gu": found.gloss,
            "known_fraction": found.known,
            **spread,
        }
    )
    note_band(brdf)
    note_known(found.known)
