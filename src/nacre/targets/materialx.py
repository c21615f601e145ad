"""MaterialX: nodes with implementations in GLSL and OSL, and a material under one light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.targets.glsl import Glsl, GlslLanguage
from nacre.targets.osl import Osl
from nacre.targets.target import Target
from nacre.targets.text import preamble

_DOCUMENT = """\
<?xml version="1.0" encoding="UTF-8"?>
<materialx version="1.39" colorspace="lin_rec709">
{preamble}
  <!-- Load this file, with the two beside it, as a library of nodes. MaterialX hands renderers -->
  <!-- sums of its own BSDFs, so that an arbitrary f_r is a color: {name}_reflectance. A graph -->
  <!-- multiplies it by what each light sends onto the surface, as {name}_lit does below; a -->
  <!-- renderer that integrates draws directions by {name}_sample. Directions are in the -->
  <!-- space of the normal and the tangent. -->

  <nodedef name="ND_{name}_reflectance" node="{name}_reflectance" nodegroup="pbr"
           doc="Reflectance f_r in 1/sr, without the cosine">
    <input name="lightdir" type="vector3" value="0, 0, 1" doc="Unit, to the light" />
    <input name="viewdir" type="vector3" value="0, 0, 1" doc="Unit, to the viewer" />
    <input name="normal" type="vector3" defaultgeomprop="Nworld" />
    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />
    <output name="out" type="color3" />
  </nodedef>
  <nodedef name="ND_{name}_sample" node="{name}_sample" nodegroup="pbr"
           doc="A direction to the light, drawn by how much is reflected from there">
    <input name="viewdir" type="vector3" value="0, 0, 1" doc="Unit, to the viewer" />
    <input name="u" type="vector3" value="0.5, 0.5, 0.5" doc="Random numbers from 0 to below 1" />
    <input name="normal" type="vector3" defaultgeomprop="Nworld" />
    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />
    <output name="lightdir" type="vector3" />
    <output name="pdf" type="float" doc="Density over solid angle; 0 discards the sample" />
  </nodedef>
  <nodedef name="ND_{name}_pdf" node="{name}_pdf" nodegroup="pbr"
           doc="Density of lightdir over solid angle among the samples for viewdir">
    <input name="lightdir" type="vector3" value="0, 0, 1" doc="Unit, to the light" />
    <input name="viewdir" type="vector3" value="0, 0, 1" doc="Unit, to the viewer" />
    <input name="normal" type="vector3" defaultgeomprop="Nworld" />
    <input name="tangent" type="vector3" defaultgeomprop="Tworld" />
    <output name="out" type="float" />
  </nodedef>
{implementations}

  <nodegraph name="{name}_lit" doc="Radiance under one directional light">
    <input name="light" type="vector3" value="0.4, 0.6, 0.7" doc="To the light, in world space" />
    <input name="irradiance" type="color3" value="3, 3, 3" doc="Of a surface facing it" />
    <normal name="normal" type="vector3">
      <input name="space" type="string" value="world" />
    </normal>
    <viewdirection name="away" type="vector3">
      <input name="space" type="string" value="world" />
    </viewdirection>
    <multiply name="viewdir" type="vector3">
      <input name="in1" type="vector3" nodename="away" />
      <input name="in2" type="float" value="-1" />
    </multiply>
    <normalize name="lightdir" type="vector3">
      <input name="in" type="vector3" interfacename="light" />
    </normalize>
    <{name}_reflectance name="reflectance" type="color3">
      <input name="lightdir" type="vector3" nodename="lightdir" />
      <input name="viewdir" type="vector3" nodename="viewdir" />
    </{name}_reflectance>
    <dotproduct name="cosine" type="float">
      <input name="in1" type="vector3" nodename="lightdir" />
      <input name="in2" type="vector3" nodename="normal" />
    </dotproduct>
    <multiply name="reflected" type="color3">
      <input name="in1" type="color3" nodename="reflectance" />
      <input name="in2" type="color3" interfacename="irradiance" />
    </multiply>
    <multiply name="seen" type="color3">
      <input name="in1" type="color3" nodename="reflected" />
      <input name="in2" type="float" nodename="cosine" />
    </multiply>
    <output name="radiance" type="color3" nodename="seen" />
  </nodegraph>
  <surface_unlit name="{name}_surface" type="surfaceshader">
    <input name="emission_color" type="color3" nodegraph="{name}_lit" output="radiance" />
  </surface_unlit>
  <surfacematerial name="{name}" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="{name}_surface" />
  </surfacematerial>
</materialx>
"""

_IMPLEMENTATION = """\
  <implementation name="IM_{name}_{node}_{target}" nodedef="ND_{name}_{node}" target="{target}"
                  file="{name}{ending}" function="{name}_{node}_node" />"""

_GLSL = """
vec3 {name}_tangent(vec3 n, vec3 along) {{
    vec3 t = along - dot(along, n) * n;
    if (dot(t, t) < 1e-12)
        t = cross(n, abs(n.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0));
    return normalize(t);
}}

vec3 {name}_local(vec3 w, vec3 n, vec3 t) {{
    return vec3(dot(w, t), dot(w, cross(n, t)), dot(w, n));
}}

void {name}_reflectance_node(
    vec3 lightdir, vec3 viewdir, vec3 shading_normal, vec3 along, out vec3 result) {{
    vec3 n = normalize(shading_normal);
    vec3 t = {name}_tangent(n, along);
    result = {name}_eval({name}_local(lightdir, n, t), {name}_local(viewdir, n, t));
}}

void {name}_sample_node(
    vec3 viewdir, vec3 u, vec3 shading_normal, vec3 along, out vec3 lightdir, out float pdf) {{
    vec3 n = normalize(shading_normal);
    vec3 t = {name}_tangent(n, along);
    vec4 drawn = {name}_sample({name}_local(viewdir, n, t), u);
    lightdir = drawn.x * t + drawn.y * cross(n, t) + drawn.z * n;
    pdf = drawn.w;
}}

void {name}_pdf_node(
    vec3 lightdir, vec3 viewdir, vec3 shading_normal, vec3 along, out float result) {{
    vec3 n = normalize(shading_normal);
    vec3 t = {name}_tangent(n, along);
    result = {name}_pdf({name}_local(lightdir, n, t), {name}_local(viewdir, n, t));
}}
"""

_OSL = """
void {name}_reflectance_node(
    vector lightdir, vector viewdir, vector shading_normal, vector along, output color result)
{{
    vector n = normalize(shading_normal);
    vector t = {name}_tangent(n, along);
    result = {name}_eval({name}_local(lightdir, n, t), {name}_local(viewdir, n, t));
}}

void {name}_sample_node(
    vector viewdir, vector u, vector shading_normal, vector along,
    output vector lightdir, output float pdf)
{{
    vector n = normalize(shading_normal);
    vector t = {name}_tangent(n, along);
    vector wi = 0;
    {name}_sample({name}_local(viewdir, n, t), u, wi, pdf);
    lightdir = wi[0] * t + wi[1] * cross(n, t) + wi[2] * n;
}}

void {name}_pdf_node(
    vector lightdir, vector viewdir, vector shading_normal, vector along, output float result)
{{
    vector n = normalize(shading_normal);
    vector t = {name}_tangent(n, along);
    result = {name}_pdf({name}_local(lightdir, n, t), {name}_local(viewdir, n, t));
}}
"""

_ENDINGS = {"genglsl": "_nodes.glsl", "genosl": "_nodes.osl"}
"""Ends of file names by MaterialX's targets; ESSL, Metal and Slang inherit the first."""

_NODES = "reflectance", "sample", "pdf"


class _Language(GlslLanguage):
    """GLSL with the names that MaterialX translates for Metal and Slang as well."""

    operations: ClassVar[Mapping[str, str]] = {
        **GlslLanguage.operations,
        "sin": "mx_sin({0})",
        "cos": "mx_cos({0})",
        "arcsin": "mx_asin({0})",
        "arctan2": "mx_atan({0}, {1})",
    }


class _Glsl(Glsl):
    language = _Language()


class MaterialX(Target):
    title = "MaterialX nodes with implementations in GLSL and OSL, and a material of one light"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        brdf = self.reflectance(material)
        implementations = [
            _IMPLEMENTATION.format(name=name, node=node, target=target, ending=ending)
            for node in _NODES
            for target, ending in _ENDINGS.items()
        ]
        document = _DOCUMENT.format(
            name=name,
            preamble="\n".join(f"  <!-- {line} -->" for line in preamble(brdf) if line),
            implementations="\n".join(implementations),
        )
        glsl = _Glsl().source(brdf, name) + _GLSL.format(name=name)
        osl = Osl().functions(brdf, name) + _OSL.format(name=name)
        texts = (_once(name, source) for source in (glsl, osl))
        files = {".mtlx": document, **dict(zip(_ENDINGS.values(), texts, strict=True))}
        return {f"{name}{ending}": text.encode() for ending, text in files.items()}


def _once(name: str, source: str) -> str:
    """Source with an include guard: MaterialX puts it into a shader once per kind of node."""
    return f"#ifndef {name}_once\n#define {name}_once\n{source}#endif\n"
