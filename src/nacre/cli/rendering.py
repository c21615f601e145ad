"""What `nacre render` does for a reflectance, a texture or a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options
from nacre.cli.reading import typed
from nacre.cli.report import aside, keyed, print_facts, progress, report
from nacre.io.names import stem
from nacre.mitsuba import scene
from nacre.mitsuba.textures import scene as texture_scene
from nacre.workflows.texture_rendering import TEXTURE_SPP

if TYPE_CHECKING:
    from nacre.metrics.temporal import TemporalErrors
    from nacre.mitsuba.environment import Environment
    from nacre.runtime.store import Store


def _check_shape(
    source: Path, chosen: dict[str, Any], kind: str, shapes: Sequence[str], lights: Sequence[str]
) -> None:
    """Refuse an object or a light for the other kind of material."""
    for name, known in (("shape", shapes), ("light", lights)):
        if chosen[name] is not None and chosen[name] not in known:
            raise click.BadParameter(
                f"--{name} {chosen[name]}: {source} is {kind}; expected one of {', '.join(known)}"
            )


def _environment(path: Path | None) -> Environment | None:
    from nacre.mitsuba.environment import load_environment

    return load_environment(path) if path else None


def _store(output: Path, inputs: Sequence[Path | None], chosen: dict[str, Any]) -> Store:
    """Where a picture is kept until it is written, for `--resume`."""
    from nacre.runtime.store import Store
    from nacre.workflows.identity import source_fingerprint

    state = output.with_name(f"{output.name}.state")
    files = [path for path in inputs if path is not None]
    options.check_outputs([output], files, [state])
    marks = [source_fingerprint(path, None if path.is_dir() else [path]) for path in files]
    settings = [f"{name}={value}" for name, value in sorted(chosen.items()) if name != "resume"]
    store = Store(state, " ".join([*marks, *settings]) + typed())
    store.check_wanted(chosen["resume"])
    return store


def render_scene(source: Path, output: Path | None, chosen: dict[str, Any]) -> None:
    from nacre.mitsuba.engine import variant_in_use
    from nacre.mitsuba.preview import check_image_path
    from nacre.mitsuba.scene_file import SceneChanges
    from nacre.mitsuba.scene_rendering import SceneRendering

    output = output or Path(f"{stem(source)}.png")
    check_image_path(output)
    store = _store(output, [source], chosen)
    width, height = chosen["size"] if options.is_given("size") else (None, None)
    changes = SceneChanges(
        dict(chosen["define"]), chosen["sensor"], width, chosen["height"] or height
    )
    clean = chosen["denoise"] and options.is_given("denoise")
    line = progress(source.stem, "compiling")
    with variant_in_use(chosen["variant"]):
        shown = output.suffix.lower() != ".exr"
        rendering = SceneRendering(
            source, chosen["spp"], chosen["seed"], changes, clean, colors=shown, store=store
        )
        show = line.parts("rendering")
        try:
            for part in rendering.passes():
                show(part)
        except KeyboardInterrupt:
            if rendering.done:
                rendering.picture().write(output)
                samples = f"{rendering.done:,} of {rendering.spp:,} samples per pixel"
                aside(f"{output}: the picture so far, {samples}")
            raise
        picture = rendering.finished()
        picture.write(output)
    store.remove()
    height, width = picture.values.shape[:2]
    data = {"output": str(output), "width": width, "height": height}
    report(f"{output}: {width} x {height} pixels", data)


def render_reflectance(source: Path, output: Path | None, chosen: dict[str, Any]) -> None:
    from nacre.formats import load_brdf
    from nacre.mitsuba.preview import check_image_path, default_spp, render_preview, write_image

    _check_shape(source, chosen, "a reflectance", scene.SHAPES, scene.LIGHTS)
    output = output or Path(f"{stem(source)}.png")
    check_image_path(output)
    store = _store(output, [source, chosen["environment"]], chosen)
    spp = chosen["spp"] or default_spp(chosen["denoise"])
    width, height = chosen["size"]
    height = chosen["height"] or height or width
    line = progress(source.stem, "reading")
    brdf = load_brdf(source)
    environment = _environment(chosen["environment"])
    line("compiling", 0, 1)
    image = render_preview(
        brdf,
        chosen["shape"] or scene.SHAPES[0],
        chosen["light"],
        (width, height),
        spp,
        chosen["seed"],
        environment,
        line.parts("rendering", spp),
        chosen["denoise"],
        store,
    )
    write_image(image, output)
    store.remove()
    data = {"output": str(output), "width": width, "height": height, "samples_per_pixel": spp}
    report(f"{output}: {width} x {height} pixels, {spp} samples per pixel", data)


def render_texture(source: Path, output: Path | None, chosen: dict[str, Any]) -> None:
    from nacre.formats import load_btf
    from nacre.mitsuba.preview import default_spp
    from nacre.workflows.texture_rendering import (
        TextureView,
        check_texture_view,
        error_text,
        render_texture,
    )

    shapes, lights = texture_scene.GEOMETRIES, texture_scene.LIGHTS
    _check_shape(source, chosen, "a texture", shapes, lights)
    frames, reference = chosen["frames"], chosen.pop("reference")
    output = output or Path(f"{stem(source)}.{'gif' if frames else 'png'}")
    if chosen.pop("height") is not None:
        raise click.UsageError(
            f"--height is for reflectances (BRDFs) and scenes; {source} is a texture"
        )
    chosen["size"], other = chosen["size"]
    if other not in (None, chosen["size"]):
        raise click.UsageError(
            f"--size {chosen['size']}x{other}: {source} is a texture, shown in a square"
        )
    if frames or reference:
        if chosen["denoise"] and options.is_given("denoise"):
            raise click.UsageError("--denoise is not for animations and comparisons of textures")
        chosen["denoise"] = False
    chosen |= {
        "shape": chosen["shape"] or texture_scene.GEOMETRIES[0],
        "spp": chosen["spp"] or default_spp(chosen["denoise"], TEXTURE_SPP),
    }
    if frames and chosen["resume"]:
        raise click.UsageError("--resume is for pictures; frames are rendered again")
    store = _store(
        output, [source, reference, chosen["height_field"], chosen["environment"]], chosen
    )
    del chosen["resume"]
    lighting = chosen.pop("environment")
    view = TextureView(**chosen)
    check_texture_view(output, view, compared=reference is not None)
    view = replace(view, environment=_environment(lighting))
    texture = load_btf(source)
    compared = load_btf(reference) if reference else None
    names = (reference.name, source.name) if reference else ("", "")
    made = render_texture(
        texture, output, view, reference=compared, names=names, start=progress, store=store
    )
    store.remove()
    text = f"{made.width} x {made.height} pixels, {view.spp} samples per pixel"
    if frames:
        text = f"{frames} frames of {text}"
    data: dict[str, Any] = {
        "output": str(output),
        "width": made.width,
        "height": made.height,
        "frames": frames or 1,
        "samples_per_pixel": view.spp,
    }
    if made.mse is not None:
        text += f", {error_text(made.mse)}"
        data["mse"] = made.mse
    steps = {} if made.temporal is None else _temporal(made.temporal)
    report(f"{output}: {text}", data | keyed(steps))
    if steps:
        print_facts("from frame to frame", steps.items())


def _temporal(errors: TemporalErrors) -> dict[str, float]:
    return {
        "variance of the error x 1e4": 1e4 * errors.variance,
        "squared steps of the error x 1e4": 1e4 * errors.error_steps,
        "squared steps of the reference x 1e4": 1e4 * errors.truth_steps,
        "squared steps of the rendering x 1e4": 1e4 * errors.other_steps,
    }
