"""OSL in Cycles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nacre.array import Weights
from tests.oracles import blender
from tests.oracles.runner import Runner

_HUGE = 1e30  # stands for what is no number, which Cycles would show as black

_SHADERS = {
    "eval": "f = shown({name}_eval(a, b));",
    "pdf": "f = shown(color({name}_pdf(a, b)));",
    "sample": """
    vector w = 0;
    float pdf = 0;
    {name}_sample(a, b, w, pdf);
    f = shown(color(w[0], w[1], w[2]));
    density = shown(color(pdf));
""",
}

_SHADER = """
color shown(color c)
{{
    return isfinite(c[0]) && isfinite(c[1]) && isfinite(c[2]) ? c : color({huge});
}}

shader pairs(vector a = 0, vector b = 0, output color f = 0, output color density = 0)
{{
    {body}
}}
"""


class Cycles(Runner):
    """Emission of a plane whose pixels are pairs, as Cycles renders it."""

    target = "osl"
    title = "Cycles"

    def missing(self) -> str | None:
        return blender.missing()

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        (first, density), _ = blender.shade(self._shader(files, name, function), a, b)
        if function == "sample":
            return np.column_stack([first, density[:, 0]])
        return first if function == "eval" else first[:, 0]

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return len(a) / blender.shade(self._shader(files, name, "eval"), a, b)[1]

    def _shader(self, files: Mapping[str, bytes], name: str, function: str) -> str:
        """The functions of an export, with a shader of pairs in place of its own."""
        functions = files[f"{name}.osl"].decode().partition(f"shader {name}_lit")[0]
        body = _SHADERS[function].format(name=name)
        return functions + _SHADER.format(body=body, huge=_HUGE)
