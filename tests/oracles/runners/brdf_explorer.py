"""The shader of a file of Disney's BRDF Explorer, read and compiled as that does."""

from __future__ import annotations

from collections.abc import Mapping

from tests.oracles.runners.opengl import OpenGlRunner

_TYPES = {"float": "float", "bool": "bool", "color": "vec3"}
"""Types of parameters, and of the uniforms that they become."""

_CALL = "BRDF(a, b, vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0))"


class BrdfExplorerRunner(OpenGlRunner):
    """The body of the shader in the version of GLSL that today's templates have."""

    target = "brdf"
    title = "OpenGL 4.1, as BRDF Explorer"
    functions = ("eval",)
    version = "410"

    def text(self, files: Mapping[str, bytes], name: str, function: str) -> tuple[str, str]:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        (content,) = files.values()
        return shader(content.decode()), _CALL


def shader(content: str) -> str:
    """The uniforms and the shader of a file, as they stand in the viewer's templates.

    Raises
    ------
    RuntimeError
        If BRDF Explorer would not load the file.
    """
    first, *lines = content.split("\n")
    if first.split(" ")[0].strip() not in ("analytic", "bparam"):
        raise RuntimeError(f"the first line is no type of BRDF: {first!r}")
    section = ""
    uniforms: list[str] = []
    body: list[str] = []
    for line in lines:
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] == "::begin":
            if section:
                raise RuntimeError(f"in section {section}: {line!r}")
            section = words[1]
        elif words[0] == "::end":
            if words[1] != section:
                raise RuntimeError(f"in section {section!r}: {line!r}")
            section = ""
        elif section == "parameters":
            if words[0] not in _TYPES:
                raise RuntimeError(f"no type of a parameter: {line!r}")
            uniforms.append(f"uniform {_TYPES[words[0]]} {words[1]};")
        elif section == "shader":
            body.append(line)
    return "\n".join([*uniforms, "", *body, ""])
