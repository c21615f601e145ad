"""`nacre measure`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli.console import (
    Stages,
    check_outputs,
    console,
    file_path,
    preset_option,
    resolution_option,
    status,
)
from nacre.cli.ranges import SEED
from nacre.errors import NacreError

if TYPE_CHECKING:
    from nacre.render.virtual import MitsubaBrdf


@click.command("measure")
@click.argument("description", metavar="BSDF_JSON", required=False)
@click.option("-o", "--output", type=file_path(), required=True, help="File to write.")
@click.option("--scene", type=file_path(), help="Mitsuba scene (.xml) in place of BSDF_JSON.")
@click.option("--bsdf", "name", metavar="ID", help="Which BSDF of the scene; needed if several.")
@resolution_option
@preset_option
@click.option("--seed", default=0, type=SEED, help="Same seed, same neural file.")
def command(
    description: str | None,
    output: Path,
    scene: Path | None,
    name: str | None,
    resolution: tuple[int, ...] | None,
    preset: str,
    seed: int,
) -> None:
    """Measure a Mitsuba BSDF virtually: a table, or a neural material fitted to it.

    BSDF_JSON is what mitsuba.load_dict takes, as JSON: '{"type": "principled", "roughness": 0.3}'.
    Textures are read at one point, their middle.
    """
    from nacre.formats import check_target, target, writer

    if (description is None) == (scene is None):
        raise click.UsageError("expected either BSDF_JSON or --scene")
    if name is not None and scene is None:
        raise click.UsageError("--bsdf chooses from a --scene")
    write = writer(output, resolution)
    check_outputs([output], [scene] if scene else [])
    brdf = _from_json(description) if description is not None else _from_scene(scene, name)
    missing = brdf.left_out()
    brdf = brdf.replaced(name=output.stem)
    check_target(output, brdf)
    if target(output).holds == "neural":
        from nacre.neural import Recipe, fit

        recipe = Recipe.preset(preset, seed=seed)
        with Stages() as stages:
            write(fit(brdf, recipe, progress=stages.add(output.stem)), output)
    else:
        write(brdf, output)
    if missing:
        status.print(f"note: {output}: without {' and '.join(missing)}", markup=False)
    console.print(f"{output}: {output.stat().st_size:,} bytes", markup=False)


def _from_json(text: str) -> MitsubaBrdf:
    """The reflectance that a dictionary describes."""
    try:
        description = json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise NacreError(
            f"BSDF_JSON: is no JSON: {error.msg} at character {error.pos + 1}"
        ) from error
    except RecursionError as error:
        raise NacreError("BSDF_JSON: is nested too deeply") from error
    if not isinstance(description, dict) or not isinstance(description.get("type"), str):
        raise NacreError('BSDF_JSON: expected an object with a type, like {"type": "plastic"}')
    return _virtual(_mitsuba("load_dict", description, "BSDF_JSON"), "BSDF_JSON")


def _refuse_constant(name: str) -> None:
    raise NacreError(f"BSDF_JSON: {name} is not a number of JSON")


def _from_scene(path: Path | None, name: str | None) -> MitsubaBrdf:
    """The reflectance of a shape in a scene file."""
    if path is None or not path.is_file():
        raise NacreError(f"{path}: is not a file")
    scene = _mitsuba("load_file", str(path), str(path))
    bsdfs = [shape.bsdf() for shape in scene.shapes() if shape.bsdf()]
    found = {bsdf.id(): bsdf for bsdf in bsdfs if bsdf.id()}
    if name is None and len(bsdfs) == 1:
        return _virtual(bsdfs[0], f"{path}: {bsdfs[0].id() or 'its BSDF'}")
    chosen = next(iter(found)) if name is None and len(found) == len(set(bsdfs)) == 1 else name
    if chosen not in found:
        problem = f"has no BSDF {name!r} on a shape" if name else "has not one BSDF; use --bsdf"
        nameless = sum(not bsdf.id() for bsdf in bsdfs)
        names = [*found, f"{nameless} without an id"] if nameless else found
        raise NacreError(f"{path}: {problem} (found: {', '.join(names) or 'none'})")
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


def _virtual(bsdf: Any, where: str) -> MitsubaBrdf:
    """A BSDF of Mitsuba as a reflectance."""
    from nacre.render.engine import mitsuba
    from nacre.render.virtual import MitsubaBrdf

    mi = mitsuba()
    if not isinstance(bsdf, mi.BSDF):
        raise NacreError(f"{where}: is not a BSDF")
    if not bsdf.flags() & int(mi.BSDFFlags.Smooth):
        raise NacreError(f"{where}: reflects in single directions only; nothing can be measured")
    try:
        return MitsubaBrdf(bsdf)
    except NacreError as error:
        raise NacreError(f"{where}: {error}") from error
