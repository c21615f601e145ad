"""Open Shading Language: functions, and a shader for one directional light."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import ClassVar

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.compile.trace import FLOAT, INDEX, MASK
from nacre.targets.program import Function
from nacre.targets.source import Body, Language, SourceTarget

FRAME = """\
// A unit tangent perpendicular to the normal; an arbitrary one if none is given.
vector {name}_tangent(vector n, vector along)
{{
    vector t = along - dot(along, n) * n;
    if (dot(t, t) < 1e-12)
        t = cross(n, abs(n[0]) < 0.5 ? vector(1, 0, 0) : vector(0, 1, 0));
    return normalize(t);
}}

// A direction in the frame of a normal and a tangent.
vector {name}_local(vector w, vector n, vector t)
{{
    return vector(dot(w, t), dot(w, cross(n, t)), dot(w, n));
}}"""
"""Functions that give directions in the local frame of `NAME_eval`."""

_SHADER = """\
// The surface under one directional light. Open Shading Language gives renderers sums of their own
// closures, so an arbitrary f_r has to be emitted: connect `radiance` with the color of an
// emission. Directions are in the space of N and I.
shader {name}_lit(
    vector light = vector(0, 0, 1),     // to the light
    color irradiance = color(1, 1, 1),  // of a surface that faces the light
    normal shading_normal = 0,          // N where it is 0
    vector tangent = 0,                 // dPdu where it is 0
    output color reflectance = 0,       // f_r
    output color radiance = 0)
{{
    vector n = normalize(dot(shading_normal, shading_normal) > 0 ? shading_normal : N);
    vector t = {name}_tangent(n, dot(tangent, tangent) > 0 ? tangent : dPdu);
    vector wi = {name}_local(normalize(light), n, t);
    vector view = normalize(dot(I, Ng) > 0 ? I : -I);  // renderers disagree about the sense of I
    reflectance = {name}_eval(wi, {name}_local(view, n, t));
    radiance = irradiance * reflectance * max(wi[2], 0.0);
}}"""


class OslLanguage(Language):
    """OSL, whose vectors always have three numbers: everything is written number by number."""

    types: ClassVar = {FLOAT: "float", INDEX: "int", MASK: "int"}
    vectors = ""
    operations: ClassVar = {**Language.operations, "arctan2": "atan2({0}, {1})"}

    _kinds: ClassVar[Mapping[str, str]] = {"rgb": "color"}

    def component(self, vector: str, index: int) -> str:
        return f"{vector}[{index}]"

    def numbers(self, values: Weights) -> str:
        (value,) = values
        return self.literal(value)

    def function(self, function: Function, name: str) -> str:
        results = function.results
        body = Body(self, function, list(itertools.chain(*results.values())))
        values = {
            result: self._value(result, [body.text(part) for part in parts])
            for result, parts in results.items()
        }
        parameters = [
            f"{self._kind(each, count)} {each}" for each, count in function.parameters.items()
        ]
        if len(values) == 1:
            ((result, value),) = values.items()
            kind, end = self._kind(result, len(results[result])), [f"return {value};"]
        else:
            kind, end = "void", [f"{result} = {value};" for result, value in values.items()]
            parameters += [
                f"output {self._kind(result, len(parts))} {result}"
                for result, parts in results.items()
            ]
        lines = [f"    {line}" for line in (*body.statements, *end)]
        return "\n".join([f"{kind} {name}({', '.join(parameters)})", "{", *lines, "}"])

    def _kind(self, name: str, count: int) -> str:
        return self._kinds.get(name, "vector" if count == 3 else "float")

    def _value(self, name: str, parts: list[str]) -> str:
        if len(parts) == 1:
            return parts[0]
        return f"{self._kind(name, len(parts))}({', '.join(parts)})"


class Osl(SourceTarget):
    title = "OSL functions, and a shader that emits what the surface reflects of one light"
    language, suffix = OslLanguage(), ".osl"

    def source(self, brdf: Brdf, name: str) -> str:
        shader = _SHADER.format(name=name)
        return f"{self.functions(brdf, name)}\n{shader}\n"

    def functions(self, brdf: Brdf, name: str) -> str:
        """The file without its shader."""
        return f"{super().source(brdf, name)}\n{FRAME.format(name=name)}\n"
