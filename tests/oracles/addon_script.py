"""The add-on and the scripts of exports in Blender; run by a Python that has `bpy`.

    python addon_script.py addon ADDON.py FOLDER SIZE OUT
    python addon_script.py script SCRIPT.py SIZE OUT
    python addon_script.py sky SCRIPT.py MAP.npy SIZE SAMPLES OUT
    python addon_script.py asset SCRIPT.py SIZE OUT
    python addon_script.py library FILE.blend OUT
    python addon_script.py hostile ADDON.py FOLDER OUT

`addon` installs the add-on, imports all files of a folder, and makes it a library. `script` runs a
script; it and `addon` render a sphere of each material in the directional light of
`nacre.mitsuba.sphere`; `asset` runs a script that makes an asset twice, the second time on what a
user changed; `sky` renders one under an environment map. `library` opens a library;
`hostile` imports the files of a folder one by one. What they find goes to OUT.json, pictures of
shape (materials, size, size, 3) or thumbnails to OUT.npy.
"""

from __future__ import annotations

import json
import math
import runpy
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
from cycles_script import _LIGHT, _MARGIN, _image, _rendered, _scene
from mathutils import Vector

_KINDS = "materials", "scenes", "objects", "meshes", "worlds", "images", "lights", "cameras"


def addon(source: str, folder: str, size: str, out: str) -> None:
    """Install, import, render, make a library."""
    _ball(int(size), 1)
    _sun()
    _enabled(source)
    names = sorted(path.name for path in Path(folder).glob("*.json"))
    bpy.ops.nacre.import_materials(directory=folder, files=[{"name": name} for name in names])
    found = _report(out)
    found["panel"] = _panel(sys.modules[Path(source).stem].NACRE_PT_material)
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = len(libraries)
    make = bpy.ops.nacre.make_library
    make(directory=folder, add_to_preferences=True)
    one = Path(folder, "one")
    one.mkdir()
    shutil.copy(Path(folder, names[0]), one)
    make(directory=str(one))
    found["again"] = _message(lambda: make(directory=str(one)))
    make(directory=str(one), replace=True)
    empty = Path(folder, "empty")
    empty.mkdir()
    found["empty"] = _message(lambda: make(directory=str(empty)))
    found["nothing"] = _message(lambda: bpy.ops.nacre.import_materials(directory=folder))
    found["libraries"] = [library.path for library in list(libraries)[before:]]
    found["materials after"] = len(bpy.data.materials)
    _write(out, found)


def script(source: str, size: str, out: str) -> None:
    """Run a script; render."""
    _ball(int(size), 1)
    _sun()
    runpy.run_path(source, run_name="__main__")
    _write(out, _report(out))


def asset(source: str, size: str, out: str) -> None:
    """Run a script, change its material, run it again; render."""
    _ball(int(size), 1)
    _sun()
    name = Path(source).stem
    other = bpy.data.materials.new(name)
    before = _counts()
    runpy.run_path(source, run_name="__main__")
    (material,) = (each for each in bpy.data.materials if each != other)
    node = next(each for each in material.node_tree.nodes if each.type == "BSDF_PRINCIPLED")
    material.name, node.inputs["Roughness"].default_value = "mine", 0.123
    material.node_tree.nodes.new("ShaderNodeRGB")
    runpy.run_path(source, run_name="__main__")
    after = _counts()
    values = {socket.identifier: _plain(socket) for socket in node.inputs}
    found = {
        "materials": sorted(each.name for each in bpy.data.materials),
        "added": {kind: after[kind] - before[kind] for kind in _KINDS},
        "other": [other.asset_data is None, other.users, list(other.keys())],
        "inputs": {name: value for name, value in values.items() if value is not None},
        "distribution": node.distribution,
        "nodes": sorted(each.type for each in material.node_tree.nodes),
        "tags": [tag.name for tag in material.asset_data.tags],
        "license": material.asset_data.license,
        "description": material.asset_data.description,
        "thumbnail": list(material.preview.image_size),
        "shades": len(set(material.preview.image_pixels)),
    }
    mesh = bpy.context.scene.objects["Icosphere"].data
    mesh.materials.append(material)
    np.save(f"{out}.npy", _rendered(Path(out))[::-1])
    _write(out, found)


def _counts() -> dict[str, int]:
    """How much of each kind a session has, but for the picture of the last render."""
    found = {kind: len(getattr(bpy.data, kind)) for kind in _KINDS}
    return found | {"images": sum(each.type != "RENDER_RESULT" for each in bpy.data.images)}


def _plain(socket: Any) -> Any:
    """The value of an input: a number, numbers, or None."""
    value = getattr(socket, "default_value", None)
    return list(value) if hasattr(value, "__len__") else value


def sky(source: str, environment: str, size: str, samples: str, out: str) -> None:
    """Run a script; render under a map as :mod:`nacre.mitsuba.environment` has it."""
    _ball(int(size), int(samples))
    runpy.run_path(source, run_name="__main__")
    scene = bpy.context.scene
    # All samples at the centers of pixels; box filters have a width of their own.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    scene.render.film_transparent = True
    scene.world = bpy.data.worlds.new("sky")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    scene.world.cycles.sampling_method = "MANUAL"
    scene.world.cycles.sample_map_resolution = 1024
    tree = scene.world.node_tree
    tree.nodes.clear()

    def linked(kind: str, *sources: Any) -> Any:
        node = tree.nodes.new(kind)
        for source, socket in zip(sources, node.inputs, strict=False):
            tree.links.new(source, socket)
        return node

    pixels = np.load(environment)[::-1]
    direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    x, y, z = linked("ShaderNodeSeparateXYZ", direction).outputs
    # Blender's up is +z, and the middle of a map lies toward +x; ours are +y and +z.
    turned = linked("ShaderNodeCombineXYZ", z, x, y)
    texture = linked("ShaderNodeTexEnvironment", turned.outputs[0])
    texture.image = _image(pixels.reshape(-1, 3), pixels.shape[1::-1])
    background = linked("ShaderNodeBackground", texture.outputs[0])
    linked("ShaderNodeOutputWorld", background.outputs[0])
    _write(out, _report(out))


def library(path: str, out: str) -> None:
    """Open a library."""
    bpy.ops.wm.open_mainfile(filepath=path)
    previews = []
    found: dict[str, Any] = {}
    for material in bpy.data.materials:
        asset = material.asset_data
        found[material.name] = {
            "catalog": asset.catalog_id,
            "tags": [tag.name for tag in asset.tags],
            "description": asset.description,
        }
        width, height = material.preview.image_size
        pixels = np.array(material.preview.image_pixels_float)
        previews.append(pixels.reshape(height, width, 4)[::-1])
    np.save(f"{out}.npy", np.stack(previews))
    _write(out, found)


def hostile(source: str, folder: str, out: str) -> None:
    """Import files that are none, one by one: messages by name."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _enabled(source)

    def imported(path: Path) -> str:
        return _message(lambda: bpy.ops.nacre.import_materials(filepath=str(path)))

    found: dict[str, Any] = {each.name: imported(each) for each in Path(folder).iterdir()}
    found["materials after"] = len(bpy.data.materials)
    _write(out, found)


def _enabled(source: str) -> None:
    bpy.ops.preferences.addon_install(filepath=source)
    bpy.ops.preferences.addon_enable(module=Path(source).stem)


def _panel(panel: Any) -> list[str]:
    """The labels that a panel draws of the first material; there is no window to draw in."""
    labels: list[str] = []

    def label(text: str) -> None:
        labels.append(text)

    def split(factor: float) -> Any:
        return SimpleNamespace(label=label)

    context = SimpleNamespace(material=bpy.data.materials[0])
    if panel.poll(context) and not panel.poll(SimpleNamespace(material=None)):
        panel.draw(SimpleNamespace(layout=SimpleNamespace(split=split)), context)
    return labels


def _message(call: Any) -> str:
    """What an operator says that fails."""
    try:
        call()
    except RuntimeError as error:
        return str(error).strip()
    return ""


def _ball(size: int, samples: int) -> None:
    """A scene of one sphere, seen as by `nacre.mitsuba.sphere`."""
    scene = _scene((size, size), samples)
    scene.cycles.shading_system = False
    scene.render.use_persistent_data = True
    scene.camera.data.ortho_scale = 2.0 / (1.0 - _MARGIN)
    scene.camera.location = 0.0, 0.0, 5.0
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=1.0)
    bpy.ops.object.shade_smooth()


def _sun() -> None:
    """A directional light of irradiance pi that casts no shadows."""
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle, sun.use_shadow = math.pi, 0.0, False
    lamp = bpy.data.objects.new("sun", sun)
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = Vector(_LIGHT).to_track_quat("Z", "Y")
    bpy.context.scene.collection.objects.link(lamp)


def _report(out: str) -> dict[str, Any]:
    """Facts and nodes of all materials, and their pictures into OUT.npy."""
    mesh = bpy.context.scene.objects["Icosphere"].data
    pictures, found = [], {}
    for material in bpy.data.materials:
        mesh.materials.clear()
        mesh.materials.append(material)
        pictures.append(_rendered(Path(out))[::-1])
        trees = [node.node_tree for node in material.node_tree.nodes if node.type == "GROUP"]
        nodes = [node for tree in trees for node in tree.nodes]
        found[material.name] = {
            "facts": material["nacre"].to_dict(),
            "ramps": {
                node.label: [[e.position, *e.color[:3]] for e in node.color_ramp.elements]
                for node in nodes
                if node.type == "VALTORGB"
            },
            "curves": {
                node.label: [list(point.location) for point in node.mapping.curves[0].points]
                for node in nodes
                if node.type == "CURVE_FLOAT"
            },
        }
    np.save(f"{out}.npy", np.stack(pictures))
    return found


def _write(out: str, found: dict[str, Any]) -> None:
    Path(f"{out}.json").write_text(json.dumps(found))


if __name__ == "__main__":
    tasks = {each.__name__: each for each in (addon, script, asset, sky, library, hostile)}
    tasks[sys.argv[1]](*sys.argv[2:])
