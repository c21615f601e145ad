"""Materials from nodes: closures whose shapes depend on the facing ratio, or Principled."""

from typing import Any

import bpy

from nacre.targets.blender_addon.reading import BENDS, FACING, LOBES, NacreMaterial, Rows

PROPERTY = "nacre"
"""Custom property of a material with facts about it."""

_LOBE = "nacre bent GGX"


def build(given: NacreMaterial) -> Any:
    """A new material for this file; one with the same name stays as it is."""
    material = bpy.data.materials.new(given.name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.use_fake_user = True  # otherwise it is lost if no object uses it
    # Cycles would darken closures whose normals are not the surface's, and turn such normals.
    material.cycles.use_bump_map_correction = False
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = 300.0, 0.0
    shader, left_out = (_closures if given.model == "closures" else _principled)(tree, given)
    tree.links.new(shader, output.inputs["Surface"])
    describe(material, given, left_out)
    return material


def describe(material: Any, given: NacreMaterial, left_out: list[str]) -> None:
    """Store facts with a material, and the parameters that this Blender has no input for."""
    facts = {"Name": given.name, **given.facts}
    if left_out:
        facts["Left out"] = f"{', '.join(left_out)}: this Blender has no such input"
        print(f"{given.name}: left out {facts['Left out']}")
    material[PROPERTY] = facts
    material.diffuse_color = (*_viewport(given), 1.0)


def _closures(tree: Any, given: NacreMaterial) -> tuple[Any, list[str]]:
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = closure_group(given.values, given.name)
    node.width, node.label = 200.0, given.name
    return node.outputs["Shader"], []


def _principled(tree: Any, given: NacreMaterial) -> tuple[Any, list[str]]:
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    if "anisotropic" in given.values:
        # Otherwise Blender uses a tangent around the object's z axis.
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.location = "UV_MAP", (-300.0, 0.0)
        tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
    return node.outputs[0], set_principled(node, given.values)


def set_principled(node: Any, values: dict[str, Rows]) -> list[str]:
    """Set the parameters of a Principled node; returns those that it has no input for."""
    node.distribution = "MULTI_GGX"
    sockets = {socket.identifier.lower().replace(" ", "_"): socket for socket in node.inputs}
    for name in values.keys() & sockets.keys():
        numbers = [row[0] for row in values[name]]
        sockets[name].default_value = (*numbers, 1.0) if len(numbers) == 3 else numbers[0]
    return sorted(values.keys() - sockets.keys())


def closure_group(values: dict[str, Rows], name: str) -> Any:
    """A node group: diffuse and GGX closures, with ramps and curves over the facing ratio.

    Its input `Normal` may stay empty. Normals of closures are normalize(N + bend V). Values are
    those of the model `closures`: `diffuse` and `color1`, ... are ramps, `bend0`, ... and
    `roughness1`, ... are curves.
    """
    group = _new_group(f"{name} closures", {"Normal": "Vector"})
    nodes = _Nodes(group)
    normal = _normal(nodes)
    view = nodes.new("ShaderNodeNewGeometry", 1, 2).outputs["Incoming"]
    facing = nodes.vector("DOT_PRODUCT", 2, 0, view, normal)
    bent = _bent(nodes, 4, normal, view, _curve(nodes, values["bend0"][0], "bend0", facing, 3, 0))
    diffuse = nodes.new("ShaderNodeBsdfDiffuse", 6, 0, Normal=bent)
    nodes.link(_ramp(nodes, values["diffuse"], "diffuse", facing, 4, 1), diffuse.inputs["Color"])
    total = diffuse.outputs[0]
    lobe = _lobe_group()
    for k in range(1, LOBES + 1):
        node = nodes.new("ShaderNodeGroup", 6, 3 * k, lobe, Normal=normal)
        nodes.link(_ramp(nodes, values[f"color{k}"], f"color{k}", facing, 4, 3 * k), node.inputs[0])
        rows = *values[f"roughness{k}"], *values[f"bend{k}"]
        labels = f"roughness{k} along", f"roughness{k} across", f"bend{k}"
        for at, (row, label) in enumerate(zip(rows, labels, strict=True)):
            curve = _curve(nodes, row, label, facing, 3 + at % 2, 3 * k + (at + 1) // 2)
            nodes.link(curve, node.inputs[1 + at])
        added = nodes.new("ShaderNodeAddShader", 6 + k, k)
        nodes.link(total, added.inputs[0])
        nodes.link(node.outputs[0], added.inputs[1])
        total = added.outputs[0]
    nodes.link(total, nodes.new("NodeGroupOutput", 7 + LOBES, LOBES).inputs["Shader"])
    return group


def _lobe_group() -> Any:
    """The group for one GGX closure, shared by all materials.

    Blender has one roughness r and an anisotropy a: the squared roughnesses along and across are
    r^2 (1 - a) and r^2 / (1 - a) for positive a, and swapped for negative a.
    """
    for group in bpy.data.node_groups:
        if group.name.startswith(_LOBE) and group.get(PROPERTY) == 1 and not group.library:
            return group
    numbers = dict.fromkeys(("Along", "Across", "Bend"), "Float")
    group = _new_group(_LOBE, {"Color": "Color", **numbers, "Normal": "Vector"})
    group[PROPERTY] = 1
    nodes = _Nodes(group)
    given = nodes.new("NodeGroupInput", 0, 1).outputs
    view = nodes.new("ShaderNodeNewGeometry", 0, 0).outputs["Incoming"]
    product = nodes.math("MULTIPLY", 1, 1, given["Along"], given["Across"])
    larger = nodes.math("MAXIMUM", 1, 2, given["Along"], given["Across"])
    difference = nodes.math("SUBTRACT", 1, 3, given["Across"], given["Along"])
    # From straight above, the view gives no tangent, and any direction will do.
    aside = nodes.vector("ADD", 1, 4, view)
    aside.node.inputs[1].default_value = 6e-5, -4e-5, 7e-5
    closure = nodes.new("ShaderNodeBsdfAnisotropic", 5, 1, Color=given["Color"], Tangent=aside)
    closure.distribution = "GGX"
    nodes.link(nodes.math("SQRT", 2, 1, product), closure.inputs["Roughness"])
    nodes.link(nodes.math("DIVIDE", 2, 2, difference, larger), closure.inputs["Anisotropy"])
    bent = _bent(nodes, 2, given["Normal"], view, given["Bend"])
    nodes.link(bent, closure.inputs["Normal"])
    nodes.link(closure.outputs[0], nodes.new("NodeGroupOutput", 6, 1).inputs["Shader"])
    return group


def _new_group(name: str, inputs: dict[str, str]) -> Any:
    """A group whose output is a shader."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for each, kind in inputs.items():
        socket = group.interface.new_socket(each, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        socket.hide_value = kind == "Vector"
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    return group


class _Nodes:
    """Nodes of a tree, placed in columns and rows."""

    def __init__(self, tree: Any) -> None:
        self._tree = tree

    def new(self, kind: str, column: int, row: int, group: Any = None, **inputs: Any) -> Any:
        """A new node; `group` makes it an instance of a node group, and `inputs` are linked."""
        node = self._tree.nodes.new(kind)
        node.location = 280.0 * column, -300.0 * row
        if group is not None:
            node.node_tree = group
        for name, output in inputs.items():
            self.link(output, node.inputs[name])
        return node

    def math(self, operation: str, column: int, row: int, *operands: Any) -> Any:
        return self._operation("ShaderNodeMath", operation, column, row, operands).outputs[0]

    def vector(self, operation: str, column: int, row: int, *operands: Any) -> Any:
        node = self._operation("ShaderNodeVectorMath", operation, column, row, operands)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def link(self, output: Any, socket: Any) -> None:
        self._tree.links.new(output, socket)

    def _operation(self, kind: str, name: str, column: int, row: int, operands: Any) -> Any:
        node = self.new(kind, column, row)
        node.operation = name
        for socket, operand in zip(node.inputs, operands, strict=False):
            self.link(operand, socket)
        return node


def _scaled(nodes: _Nodes, column: int, row: int, vector: Any, factor: Any) -> Any:
    scaled = nodes.vector("SCALE", column, row, vector)
    nodes.link(factor, scaled.node.inputs["Scale"])
    return scaled


def _bent(nodes: _Nodes, column: int, normal: Any, view: Any, bend: Any) -> Any:
    """normalize(N + bend V) as nodes."""
    added = nodes.vector("ADD", column + 1, 0, normal, _scaled(nodes, column, 0, view, bend))
    return nodes.vector("NORMALIZE", column + 2, 0, added)


def _normal(nodes: _Nodes) -> Any:
    """The normal from the group's input or, if that is empty, the surface's.

    Renderers fill an empty normal of a closure with the surface's, but that of a group is 0.
    """
    given = nodes.new("NodeGroupInput", -2, 0).outputs["Normal"]
    surface = nodes.new("ShaderNodeNewGeometry", -2, 1).outputs["Normal"]
    empty = nodes.math("LESS_THAN", 0, 0, nodes.vector("DOT_PRODUCT", -1, 0, given, given))
    empty.node.inputs[1].default_value = 1e-6
    own = _scaled(nodes, 0, 1, surface, empty)
    return nodes.vector("NORMALIZE", 1, 1, nodes.vector("ADD", 1, 0, given, own))


def _ramp(nodes: _Nodes, rows: Rows, label: str, facing: Any, column: int, row: int) -> Any:
    """A color ramp through a table with three rows."""
    node = nodes.new("ShaderNodeValToRGB", column, row)
    node.label = label
    nodes.link(facing, node.inputs[0])
    ramp = node.color_ramp
    ramp.color_mode, ramp.interpolation = "RGB", "LINEAR"
    for at in FACING[1:-1]:  # a new ramp has stops at 0 and 1
        ramp.elements.new(at)
    for element, color in zip(ramp.elements, zip(*rows, strict=True), strict=True):
        element.color = (*color, 1.0)
    return node.outputs[0]


def _curve(nodes: _Nodes, row: list[float], label: str, facing: Any, column: int, at: int) -> Any:
    """A curve of straight segments through a row."""
    node = nodes.new("ShaderNodeFloatCurve", column, at)
    node.label = label
    nodes.link(facing, node.inputs["Value"])
    curve = node.mapping.curves[0]
    node.mapping.clip_min_y, node.mapping.clip_max_y = (
        BENDS if label.startswith("bend") else (0.0, 1.0)
    )
    for position in FACING[1:-1]:
        curve.points.new(position, 0.0)
    for point, number in zip(curve.points, row, strict=True):
        point.location[1] = number
        point.handle_type = "VECTOR"
    node.mapping.update()
    return node.outputs[0]


def _viewport(given: NacreMaterial) -> list[float]:
    """Color in solid views: about what is reflected toward a viewer straight above."""
    values = given.values
    if given.model != "closures":
        return [row[0] for row in values["base_color"]]
    colors = [values["diffuse"], *(values[f"color{k}"] for k in range(1, LOBES + 1))]
    return [min(sum(rows[channel][-1] for rows in colors), 1.0) for channel in range(3)]
