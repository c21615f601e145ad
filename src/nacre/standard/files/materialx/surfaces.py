"""Surfaces that are read, by the categories of their nodes."""

from __future__ import annotations

from collections.abc import Mapping

from nacre.standard.files.materialx.disney_surface import DISNEY
from nacre.standard.files.materialx.gltf_surfaces import GLTF, USD
from nacre.standard.files.materialx.openpbr_surfaces import OPEN_PBR, STANDARD_SURFACE
from nacre.standard.files.materialx.surface import Surface
from nacre.standard.files.openpbr_inputs import NODE

SURFACES: Mapping[str, Surface] = {
    NODE: OPEN_PBR,
    "standard_surface": STANDARD_SURFACE,
    "gltf_pbr": GLTF,
    "UsdPreviewSurface": USD,
    "disney_principled": DISNEY,
}
