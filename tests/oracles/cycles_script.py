"""OSL shaders and the Principled node in Cycles; run by a Python that has `bpy`, which need not be
nacre's.

    python cycles_script.py pairs SHADER.osl PAIRS.npy OUT.npy
    python cycles_script.py sphere SHADER.osl SIZE SAMPLES OUT.npy
    python cycles_script.py closures SHADER.osl SIZE SAMPLES ENVIRONMENT.npy OUT.npy
    python cycles_script.py principled GIVEN.npz OUT.npy

`pairs`: the shader has the inputs `vector a, vector b` and outputs of colors. PAIRS has shape
(2, n, 3); OUT gets shape (outputs, n, 3). Each pair is a pixel of a plane that emits an output.
Prints the seconds of each render; there is one more at the end, of the first output, when all is
compiled.

`sphere`: the shader `NAME_lit` of an export, as emission of a sphere; OUT gets shape
(size, size, 3). Light and view are those of `nacre.mitsuba.sphere`.

`closures`: the output BSDF of the shader, as the surface of the same sphere, at one bounce, under
a sun of irradiance pi and then in an environment whose picture, in Cycles' own layout, is a `.npy`
of shape (height, width, 3), from the lowest row up; OUT gets shape (2, size, size, 3).

`principled`: GIVEN holds `angles` of shape (k,), in radians between light and view; `normals` and
`tangents` of shape (k, n, 3), where the view is +z and the light lies toward +x; and for each input
of the node, by identifier, an array of shape (n,) or (n, 3). OUT gets what a light of irradiance pi
makes of each, shape (k, n, 3). Every pixel has its own normal, tangent and parameters; nothing in a
picture is random. Where GIVEN has `samples`, the light is a white sky instead of which so many are
taken, angles are between normal and view, and there are no normals and tangents.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np

_WIDTH = 1024  # pixels
_LIGHT = -0.5, 0.5, math.sqrt(0.5)
_MARGIN = 0.03


def pairs(shader: str, given: str, out: str) -> None:
    """Render each output of a shader of pairs."""
    vectors = np.load(given)
    count = vectors.shape[1]
    size = _WIDTH, max(-(-count // _WIDTH), 4)
    scene = _scene(size, 1)
    x, y = (0.5 * length / max(size) for length in size)
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new().data.foreach_set("uv", (0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0))
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    tree, script = _emission(mesh, shader)
    for name, values in zip("ab", vectors, strict=True):
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image, texture.interpolation = _image(values, size), "Closest"
        tree.links.new(texture.outputs["Color"], script.inputs[name])
    results = []
    for output in (*script.outputs, script.outputs[0]):
        tree.links.new(output, tree.nodes["Emission"].inputs["Color"])
        start = time.perf_counter()
        results.append(_rendered(Path(out)).reshape(-1, 3)[:count])
        print("seconds", time.perf_counter() - start)
    np.save(out, np.stack(results[:-1]))


def sphere(shader: str, size: str, samples: str, out: str) -> None:
    """Render a sphere with the shader of an export."""
    scene = _scene((int(size), int(size)), int(samples))
    scene.cycles.filter_width = 1.0
    scene.camera.data.ortho_scale = 2.0 / (1.0 - _MARGIN)
    scene.camera.location = 0.0, 0.0, 5.0
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=8, radius=1.0)
    bpy.ops.object.shade_smooth()
    tree, script = _emission(bpy.context.object.data, shader)
    script.inputs["light"].default_value = _LIGHT
    script.inputs["irradiance"].default_value = math.pi, math.pi, math.pi, 1.0
    east = tree.nodes.new("ShaderNodeVectorMath")
    east.operation = "CROSS_PRODUCT"
    east.inputs[0].default_value = 0.0, 1.0, 0.0
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], east.inputs[1])
    tree.links.new(east.outputs[0], script.inputs["tangent"])
    tree.links.new(script.outputs["radiance"], tree.nodes["Emission"].inputs["Color"])
    np.save(out, _rendered(Path(out))[::-1])


def closures(shader: str, size: str, samples: str, environment: str, out: str) -> None:
    """Render a sphere whose surface a shader makes, under the light and in the environment."""
    scene = _scene((int(size), int(size)), int(samples))
    scene.cycles.pixel_filter_type = "GAUSSIAN"  # whose width counts: pixels' centers alone
    scene.camera.data.ortho_scale = 2.0 / (1.0 - _MARGIN)
    scene.camera.location = 0.0, 0.0, 5.0
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=8, radius=1.0)
    bpy.ops.object.shade_smooth()
    mesh = bpy.context.object.data
    tree, script = _emission(mesh, shader)
    mesh.materials[0].cycles.use_bump_map_correction = False
    surface = tree.nodes["Material Output"].inputs["Surface"]
    tree.links.new(script.outputs["BSDF"], surface)
    light = bpy.data.lights.new("sun", "SUN")
    light.energy, light.angle = math.pi, 0.0
    sun = bpy.data.objects.new("sun", light)
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = mathutils.Vector(_LIGHT).to_track_quat("Z", "Y")
    scene.collection.objects.link(sun)
    pictures = [_rendered(Path(out))[::-1]]
    scene.collection.objects.unlink(sun)
    pixels = np.load(environment)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    around = nodes.new("ShaderNodeTexEnvironment")
    around.image = _image(pixels.reshape(-1, 3), (pixels.shape[1], pixels.shape[0]))
    links.new(around.outputs["Color"], nodes["Background"].inputs["Color"])
    scene.render.film_transparent = True
    pictures.append(_rendered(Path(out))[::-1])
    np.save(out, np.stack(pictures))


def principled(given: str, out: str) -> None:
    """Render the Principled node, a picture an angle."""
    arrays = dict(np.load(given))
    angles, normals = arrays.pop("angles"), arrays.pop("normals", None)
    tangents, samples = arrays.pop("tangents", None), int(arrays.pop("samples", 0))
    count = len(next(iter(arrays.values())))
    size = _WIDTH // 4, max(-(-4 * count // _WIDTH), 4)
    results = []
    for k, angle in enumerate(angles.tolist()):
        scene = _scene(size, max(samples, 1))
        scene.cycles.shading_system = False
        if samples:
            _plane(scene, size, 2.0 * angle)
            _sky(scene)
            given_here = arrays
        else:
            _plane(scene, size, angle)
            _light(scene, angle)
            given_here = {**arrays, "Normal": normals[k], "Tangent": tangents[k]}
        node = _node()
        inputs = {socket.identifier: socket for socket in node.inputs}
        for name, values in given_here.items():
            columns = values if values.ndim == 2 else np.repeat(values[:, None], 3, axis=1)
            _linked(inputs[name], _image(columns.astype(np.float32), size))
        if not samples:
            normal = inputs["Normal"].links[0].from_socket
            node.id_data.links.new(normal, inputs["Coat Normal"])
        results.append(_rendered(Path(out)).reshape(-1, 3)[:count])
    np.save(out, np.stack(results))


def _scene(size: tuple[int, int], samples: int) -> Any:
    """An empty scene, seen along -z, whose pixels are written as they are."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device, cycles.shading_system = "CYCLES", "CPU", True
    cycles.samples, cycles.max_bounces = samples, 0
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    cycles.sample_clamp_direct = 0.0  # no limit
    render.resolution_x, render.resolution_y = size
    render.threads_mode, render.threads = "FIXED", 1
    render.use_compositing = render.use_sequencer = False
    images = render.image_settings
    images.file_format, images.color_mode = "OPEN_EXR", "RGB"
    images.color_depth, images.exr_codec = "32", "NONE"
    scene.view_settings.view_transform = "Raw"
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    scene.camera.location = 0.0, 0.0, 1.0
    scene.collection.objects.link(scene.camera)
    return scene


def _emission(mesh: Any, shader: str) -> tuple[Any, Any]:
    """Give a mesh an emission: its node tree, and the node of a shader that is not linked yet."""
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    mesh.materials.append(material)
    tree = material.node_tree
    tree.nodes.clear()
    surface = tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    tree.links.new(tree.nodes.new("ShaderNodeEmission").outputs[0], surface)
    script = tree.nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(Path(shader).resolve())
    if not script.outputs:
        sys.exit("the shader does not compile")
    return tree, script


def _image(values: np.ndarray, size: tuple[int, int]) -> Any:
    """Vectors as pixels of an image, repeated to its end."""
    image = bpy.data.images.new("vectors", *size, float_buffer=True, is_data=True)
    pixels = np.ones((size[0] * size[1], 4), np.float32)
    pixels[:, :3] = np.resize(values, (len(pixels), 3))
    image.pixels.foreach_set(pixels.reshape(-1))
    return image


def _plane(scene: Any, size: tuple[int, int], angle: float) -> None:
    """A plane that fills the picture and that light and view see equally well."""
    x, y = (0.5 * length / max(size) for length in size)
    tilt = -math.tan(0.5 * angle)
    mesh = bpy.data.meshes.new("plane")
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    mesh.from_pydata([(u, v, tilt * u) for u, v in corners], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new().data.foreach_set("uv", (0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0))
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    scene.camera.location = 0.0, 0.0, 20.0


def _light(scene: Any, angle: float) -> None:
    light = bpy.data.lights.new("sun", "SUN")
    light.energy, light.angle = math.pi, 0.0
    sun = bpy.data.objects.new("sun", light)
    sun.rotation_euler = 0.0, angle, 0.0
    scene.collection.objects.link(sun)


def _sky(scene: Any) -> None:
    """White light from everywhere."""
    scene.world = bpy.data.worlds.new("sky")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    white = tree.nodes.new("ShaderNodeBackground")
    white.inputs["Color"].default_value = 1.0, 1.0, 1.0, 1.0
    tree.links.new(white.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])


def _node() -> Any:
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    material.cycles.use_bump_map_correction = False
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.distribution = "MULTI_GGX"
    surface = tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    tree.links.new(node.outputs[0], surface)
    bpy.data.meshes["plane"].materials.append(material)
    return node


def _linked(socket: Any, image: Any) -> None:
    tree = socket.id_data
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(texture.outputs["Color"], socket)


def _rendered(out: Path) -> np.ndarray:
    """Colors of the pixels, shape (height, width, 3), from the lowest row up."""
    render = bpy.context.scene.render
    render.filepath = str(out.with_suffix(".exr"))
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(pixels.reshape(-1))
    bpy.data.images.remove(image)
    return pixels[..., :3]


if __name__ == "__main__":
    # Cycles looks at the parameters of a shader with a module that comes with Blender.
    local = Path(bpy.utils.resource_path("LOCAL"), "python", "lib")
    sys.path.append(str(local / "python{}.{}".format(*sys.version_info) / "site-packages"))
    tasks: dict[str, Any] = {
        "pairs": pairs,
        "sphere": sphere,
        "principled": principled,
        "closures": closures,
    }
    tasks[sys.argv[1]](*sys.argv[2:])
