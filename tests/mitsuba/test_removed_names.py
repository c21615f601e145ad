"""Names that Mitsuba 3.10 and Dr.Jit's porting guides remove are used nowhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.mesh import triangle_mesh

REMOVED = {
    "parameters and buffers of meshes": (
        *("vertex_positions", "vertex_normals", "vertex_texcoords"),
        *("vertex_positions_buffer", "vertex_normals_buffer", "vertex_texcoords_buffer"),
        *("faces_buffer", "recompute_vertex_normals"),
    ),
    "arguments that make an empty mesh": (
        *("vertex_count=", "face_count=", "has_vertex_normals=", "has_vertex_texcoords="),
    ),
    "properties": ("remove_property", "mark_queried", "has_property"),
    "threads": ("ThreadEnvironment", "ScopedSetThreadEnvironment"),
}
"""By what they are of: the rewritten class of meshes in the release that follows 3.9 (pull request
1933), and what 3.7 to 3.9 deprecate."""

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("kind", REMOVED)
def test_no_source_uses_what_mitsuba_removes(kind: str) -> None:
    pattern = re.compile("|".join(rf"\b{re.escape(name)}(?!\w)" for name in REMOVED[kind]))
    found = []
    for folder in ("src", "lab", "tests", "docs", "scripts", "packaging"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".md", ".ipynb") and path.name != Path(__file__).name:
                lines = path.read_text(encoding="utf-8").splitlines()
                places = [n for n, line in enumerate(lines, 1) if pattern.search(line)]
                found += [f"{path.relative_to(ROOT)}:{n}" for n in places]
    assert not found


def test_meshes_have_what_they_are_made_of(scalar: object) -> None:
    import numpy as np

    mi = mitsuba()
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    bent = np.array([[0, 0.6, 0.8]] * 4, np.float32)
    ray = mi.Ray3f(mi.Point3f(0.25, 0.75, 1.0), mi.Vector3f(0.0, 0.0, -1.0))
    for normals in (None, bent):
        bsdf = {"type": "diffuse", "id": "paint"}
        mesh = triangle_mesh(mi, "square", corners, faces, bsdf, corners[:, :2], normals)
        hit = mi.load_dict({"type": "scene", "square": mesh}).ray_intersect(ray)
        assert (mesh.id(), mesh.bsdf().id()) == ("square", "paint")
        np.testing.assert_allclose(hit.uv, [0.25, 0.75], atol=1e-6)
        np.testing.assert_allclose(hit.n, [0.0, 0.0, 1.0], atol=1e-6)
        expected = [0.0, 0.0, 1.0] if normals is None else bent[0]
        np.testing.assert_allclose(hit.sh_frame.n, expected, atol=1e-6)
