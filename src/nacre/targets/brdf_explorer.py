"""Files for Disney's BRDF Explorer.

A file is the word "analytic" and sections of lines. The shader section defines `BRDF`, which plots
call in vertex shaders and pictures in fragment shaders. The first release compiles it as GLSL 1.30,
later ones as 4.10; the output is valid in both. Lines that start with # are dropped, even inside
the shader. No release calls a sampler, so none is written.

Source: github.com/wdas/brdf, `BRDFBase.cpp` and the shader templates.
"""

from __future__ import annotations

from nacre.brdf import Brdf
from nacre.targets.source import Language, SourceTarget
from nacre.targets.text import preamble

_FILE = """\
analytic

{preamble}

::begin parameters
::end parameters

::begin shader

{eval}

vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y)
{{
    vec3 wi = vec3(dot(L, X), dot(L, Y), dot(L, N));
    vec3 wo = vec3(dot(V, X), dot(V, Y), dot(V, N));
    return {name}_eval(wi, wo);
}}

::end shader
"""


class ExplorerLanguage(Language):
    """GLSL 1.30; comments are those of the file format."""

    comment = "# "


class BrdfExplorer(SourceTarget):
    title = "file of Disney's BRDF Explorer"
    language, suffix = ExplorerLanguage(), ".brdf"

    def source(self, brdf: Brdf, name: str) -> str:
        head = "\n".join(self.language.comments(preamble(brdf)))
        return _FILE.format(preamble=head, eval=self.written(brdf, name)["eval"], name=name)
