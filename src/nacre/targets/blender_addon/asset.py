"""A material as an asset with a thumbnail; nothing else in a session changes."""

import math
import tempfile
from pathlib import Path
from typing import Any

import bmesh
import bpy

from nacre.targets.blender_addon.nodes import build, describe, set_principled
from nacre.targets.blender_addon.reading import NacreMaterial

_KEY = "nacre_asset"  # custom property by which a script knows the material that it made before

_PIXELS = 128
_SAMPLES = 24


def make_asset(given: NacreMaterial) -> Any:
    """A Principled material for this file, as an asset.

    A material that this function made before gets its parameters again, even if it was renamed;
    nodes that were added to it stay.
    """
    key = f"{given.model} {given.name}"
    made = [m for m in bpy.data.materials if m.get(_KEY) == key and m.library is None]
    nodes = [n for m in made[:1] for n in m.node_tree.nodes if n.type == "BSDF_PRINCIPLED"]
    if nodes:
        material = made[0]
        describe(material, given, set_principled(nodes[0], given.values))
    else:
        material = build(given)
        material[_KEY] = key
    mark(material, given)
    if bpy.app.background:
        _thumbnail_here(material)
    else:
        material.asset_generate_preview()
    return material


def mark(material: Any, given: NacreMaterial) -> None:
    """Mark a material as an asset, with its facts."""
    material.asset_mark()
    asset = material.asset_data
    asset.description = "; ".join(f"{key}: {text}" for key, text in given.facts.items())[:1000]
    asset.license = given.facts.get("Source terms", "")
    for tag in ("nacre", given.model):
        asset.tags.new(tag, skip_if_exists=True)


def studio() -> tuple[Any, Any]:
    """A new scene that renders thumbnails, and the ball in it: a key light, a rim light, a gray
    sky.
    """
    scene = bpy.data.scenes.new("nacre thumbnail")
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = _SAMPLES, False
    scene.render.resolution_x = scene.render.resolution_y = _PIXELS
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("nacre sky")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    sky = scene.world.node_tree.nodes.get("Background") or _background(scene.world.node_tree)
    sky.inputs["Color"].default_value = 0.3, 0.3, 0.3, 1.0
    for place, power in (((-3.0, 3.0, 4.0), 250.0), ((4.0, 1.0, -2.0), 150.0)):
        lamp = bpy.data.objects.new("light", bpy.data.lights.new("light", "AREA"))
        lamp.data.energy, lamp.data.size, lamp.location = power, 1.5, place
        lamp.rotation_euler = _toward_center(place)
        scene.collection.objects.link(lamp)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.1, (0.0, 0.0, 5.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    mesh = bpy.data.meshes.new("ball")
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=96, v_segments=48, radius=1.0, calc_uvs=True)
    for face in shape.faces:
        face.smooth = True
    shape.to_mesh(mesh)
    shape.free()
    ball = bpy.data.objects.new("ball", mesh)
    scene.collection.objects.link(ball)
    return scene, ball


def thumbnail(scene: Any, ball: Any, material: Any) -> None:
    """Render the preview of a material; Blender has no job for that without a window."""
    ball.data.materials.clear()
    ball.data.materials.append(material)
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder, "thumbnail.png"))
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(scene.render.filepath)
        preview = material.preview_ensure()
        preview.image_size = image.size
        preview.image_pixels_float[:] = image.pixels[:]
        bpy.data.images.remove(image)


def _thumbnail_here(material: Any) -> None:
    """Render the thumbnail in a temporary scene."""
    scene, ball = studio()
    try:
        thumbnail(scene, ball, material)
    finally:
        ball.data.materials.clear()
        data = [o.data for o in scene.objects]
        bpy.data.batch_remove([scene.world, *scene.objects, *data, scene])


def _background(tree: Any) -> Any:
    sky, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(sky.outputs[0], output.inputs["Surface"])
    return sky


def _toward_center(place: tuple[float, float, float]) -> tuple[float, float, float]:
    """Euler angles of a lamp at a place; it shines along its -z axis."""
    x, y, z = place
    return math.atan2(math.hypot(x, y), z), 0.0, math.atan2(y, x) + math.pi / 2.0
