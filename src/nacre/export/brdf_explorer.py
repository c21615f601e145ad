"""Files of Disney's BRDF Explorer.

A file is the word "analytic" and sections of lines; that of the shader defines `BRDF`, which the
plots call in vertex shaders and the pictures in fragment shaders. The first release compiles it as
GLSL 1.30, later ones as 4.10: what is written is valid in both. Lines that begin with # are
dropped, within the shader too. A sampler could be written down, but no release calls one.

Source: github.com/wdas/brdf, `BRDFBase.cpp` and the shader templates.
"""

from __future__ import annotations

from nacre.brdf import Brdf
from nacre.export.source import Language, SourceTarget
from nacre.export.text import preamble

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
    """GLSL without what versions after 1.30 brought; comments are those of the file."""

    comment = "# "


class BrdfExplorer(SourceTarget):
    """See :mod:`nacre.export.brdf_explorer`."""

    title = "file of Disney's BRDF Explorer"
    language, suffix = ExplorerLanguage(), ".brdf"

    def source(self, brdf: Brdf, name: str) -> str:
        """The whole file."""
        head = "\n".join(self.language.comments(preamble(brdf)))
        return _FILE.format(preamble=head, eval=self.written(brdf, name)["eval"], name=name)
