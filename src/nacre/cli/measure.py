"""`nacre measure`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from nacre.brdf import Brdf
from nacre.cli.console import Stages, check_outputs, console, file_path, resolution_option
from nacre.files import NacreError


@click.command("measure")
@click.argument("description", metavar="BSDF_JSON", required=False)
@click.option("-o", "--output", type=file_path(), required=True, help="File to write.")
@click.option("--scene", type=file_path(), help="Mitsuba scene (.xml) in place of BSDF_JSON.")
@click.option("--bsdf", "name", metavar="ID", help="Which BSDF of the scene; needed if several.")
@resolution_option
@click.option("--draft", is_flag=True, help="Quick look: a fifth of the epochs, where it fits.")
@click.option("--seed", default=0, type=click.IntRange(0), help="Same seed, same neural file.")
def command(
    description: str | None,
    output: Path,
    scene: Path | None,
    name: str | None,
    resolution: tuple[int, ...] | None,
    draft: bool,
    seed: int,
) -> None:
    """Measure a Mitsuba BSDF virtually: a table, or a neural material fitted to it.

    BSDF_JSON is what mitsuba.load_dict takes, as JSON: '{"type": "principled", "roughness": 0.3}'.
    Textures are read at one point.
    """
    from nacre.formats import check_target, target, writer

    if (description is None) == (scene is None):
        raise click.UsageError("expected either BSDF_JSON or --scene")
    write = writer(output, resolution)
    check_outputs([output], [scene] if scene else [])
    brdf = _from_json(description) if description is not None else _from_scene(scene, name)
    brdf.name = output.stem
    check_target(output, brdf)
    if target(output).holds == "neural":
        from nacre.neural import Recipe, fit

        recipe = Recipe(epochs=20, seed=seed) if draft else Recipe(seed=seed)
        with Stages() as stages:
            brdf = fit(brdf, recipe, progress=stages.add(output.stem))
    write(brdf, output)
    console.print(f"{output}: {output.stat().st_size:,} bytes", markup=False)


def _from_json(text: str) -> Brdf:
    """The reflectance that a dictionary describes."""
    try:
        description = json.loads(text)
    except json.JSONDecodeError as error:
        raise NacreError(
            f"BSDF_JSON: is no JSON: {error.msg} at character {error.pos + 1}"
        ) from error
    if not isinstance(description, dict) or "type" not in description:
        raise NacreError('BSDF_JSON: expected an object with a type, like {"type": "plastic"}')
    return _virtual(_mitsuba("load_dict", description, "BSDF_JSON"), "BSDF_JSON")


def _from_scene(path: Path | None, name: str | None) -> Brdf:
    """The reflectance of a shape in a scene file."""
    if path is None or not path.is_file():
        raise NacreError(f"{path}: is not a file")
    scene = _mitsuba("load_file", str(path), str(path))
    found = {shape.bsdf().id(): shape.bsdf() for shape in scene.shapes() if shape.bsdf()}
    chosen = name if name is not None or len(found) != 1 else next(iter(found))
    if chosen not in found:
        problem = f"has no BSDF {name!r} on a shape" if name else "has not one BSDF; use --bsdf"
        raise NacreError(f"{path}: {problem} (found: {', '.join(found) or 'none'})")
    return _virtual(found[chosen], f"{path}: {chosen}")


def _mitsuba(function: str, argument: Any, where: str) -> Any:
    """What one of Mitsuba's loaders makes of an argument; its complaints in one line."""
    from nacre.render import register
    from nacre.render.engine import mitsuba

    mi = mitsuba()
    register()
    try:
        return getattr(mi, function)(argument)
    except NacreError:
        raise
    except Exception as error:  # Mitsuba raises what its parser, plugins and pybind meet
        raise NacreError(f"{where}: Mitsuba: {' '.join(str(error).split())}") from error


def _virtual(bsdf: Any, where: str) -> Brdf:
    """A BSDF of Mitsuba as a reflectance."""
    from nacre.render.engine import mitsuba
    from nacre.render.virtual import MitsubaBrdf

    mi = mitsuba()
    if not isinstance(bsdf, mi.BSDF):
        raise NacreError(f"{where}: is not a BSDF")
    if not bsdf.flags() & int(mi.BSDFFlags.Smooth):
        raise NacreError(f"{where}: reflects in single directions only; nothing can be measured")
    return MitsubaBrdf(bsdf)
