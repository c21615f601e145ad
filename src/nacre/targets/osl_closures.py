"""Open Shading Language: a shader that makes closures, which renderers sample and light."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.standard.bent_closures import LOBES, NODES
from nacre.targets.target import Target
from nacre.targets.text import facts, shortest

_SHADER = """\
{preamble}
//
// A diffuse closure and GGX closures whose numbers are functions of the facing ratio, linear
// between its nodes. Connect BSDF with the surface; where the renderer corrects normals of bump
// maps (Blender: Material > Settings > Bump Map Correction), switch that off.

#define NODES {count}

float {name}_at(float values[NODES], float parts[NODES])
{{
    float total = values[0];
    for (int k = 1; k < NODES; ++k)
        total += parts[k] * (values[k] - values[k - 1]);
    return total;
}}

color {name}_color(color values[NODES], float parts[NODES])
{{
    color total = values[0];
    for (int k = 1; k < NODES; ++k)
        total += parts[k] * (values[k] - values[k - 1]);
    return total;
}}

shader {name}_closures(
    normal shading_normal = 0,  // N where it is 0
    output closure color BSDF = 0)
{{
    float nodes[NODES] = {{{nodes}}};
{tables}

    normal n = normalize(dot(shading_normal, shading_normal) > 0 ? shading_normal : N);
    vector view = normalize(dot(I, Ng) > 0 ? I : -I);  // renderers disagree about the sense of I
    float facing = dot(n, view);
    float parts[NODES];
    parts[0] = 1;
    for (int k = 1; k < NODES; ++k)
        parts[k] = clamp((facing - nodes[k - 1]) / (nodes[k] - nodes[k - 1]), 0, 1);

    BSDF = {name}_color(diffuse_color, parts)
        * diffuse(normalize(n + {name}_at(bend0, parts) * view));
{lobes}
}}
"""

_LOBE = """\
    float along{k} = {name}_at(along{k}_roughness, parts);
    float across{k} = {name}_at(across{k}_roughness, parts);
    BSDF += {name}_color(color{k}, parts)
        * microfacet("ggx", normalize(n + {name}_at(bend{k}, parts) * view), view,
                     along{k} * along{k}, across{k} * across{k}, 1e6, 0);"""


class OslClosures(Target):
    title = "OSL: a shader of closures, for renderers that light surfaces themselves"
    model = "closures"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        mixture = self.of_model(material)
        rows = {key: np.array(value) for key, value in mixture.values.items()}
        tables = [_colors("diffuse_color", rows["diffuse"]), _numbers("bend0", rows["bend0"][0])]
        for k in range(1, LOBES + 1):
            along, across = rows[f"roughness{k}"]
            tables += [
                _colors(f"color{k}", rows[f"color{k}"]),
                _numbers(f"along{k}_roughness", along),
                _numbers(f"across{k}_roughness", across),
                _numbers(f"bend{k}", rows[f"bend{k}"][0]),
            ]
        text = _SHADER.format(
            preamble="\n".join(f"// {line}" for line in facts(mixture).values()),
            name=name,
            count=len(NODES),
            nodes=_list(NODES),
            tables="\n".join(tables),
            lobes="\n".join(_LOBE.format(k=k, name=name) for k in range(1, LOBES + 1)),
        )
        return {f"{name}.osl": text.encode()}


def _list(numbers: Iterable[float]) -> str:
    return ", ".join(shortest(np.float32(x)) for x in numbers)


def _numbers(name: str, row: Floats) -> str:
    return f"    float {name}[NODES] = {{{_list(row)}}};"


def _colors(name: str, rows: Floats) -> str:
    colors = (f"        color({_list(rgb)})" for rgb in rows.T)
    return "\n".join([f"    color {name}[NODES] = {{", ",\n".join(colors), "    };"])
