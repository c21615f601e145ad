"""Integrals over the hemisphere that are right for near mirrors.

Directions are those of half vectors, in whose plane a lobe of microfacets is round and centered at
the normal whatever the incidence: d omega = 4 (w . h) d omega_h (Torrance and Sparrow 1967; Walter
et al. 2007, equation 14).
"""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Doubles
from nacre.instruments.apertures import turned
from nacre.instruments.quadrature import EXACT, Rule, circle, graded, on_interval

_EDGE = 1e-3  # width in radians of the panel beside the last half vectors above the horizon


def hemisphere(fixed: Doubles, rule: Rule = EXACT) -> tuple[Doubles, Doubles]:
    """All directions of the upper hemisphere, (n, 3), as reflections of a `fixed` one, (3,).

    The weights are solid angles in sr, (n,). The nodes are dense where a smooth surface mirrors the
    fixed direction, which must be above the horizon.
    """
    polar = math.acos(min(1.0, float(fixed[2])))
    azimuth = math.atan2(float(fixed[1]), float(fixed[0]))
    sine, cosine = math.sin(polar), math.cos(polar)
    # Up to `whole`, all half vectors reflect to above the horizon; up to `last`, some do.
    whole, last = 0.25 * math.pi - 0.5 * polar, 0.25 * math.pi + 0.5 * polar
    theta, widths = graded(0.0, whole, 0.0, rule.finest)
    phi, step = circle(rule.around)
    parts = [_grid(theta, widths, np.tile(phi, (len(theta), 1)), np.full((len(theta), 1), step))]
    if last > whole:
        # The range of azimuths starts and ends with roots; the tail of a lobe goes on from `whole`.
        middle = 0.5 * (whole + last)
        halves = graded(whole, middle, whole, rule.finest), graded(middle, last, last, _EDGE)
        outer, steps = (np.concatenate(part) for part in zip(*halves, strict=True))
        limit = (0.5 / np.cos(outer) - np.cos(outer)) * cosine / (np.sin(outer) * sine)
        most = np.arccos(np.clip(limit, -1.0, 1.0))
        nodes, shares = on_interval(-1.0, 1.0, rule.around)
        parts.append(_grid(outer, steps, most[:, None] * nodes, most[:, None] * shares))
    half, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    half = turned(half, math.degrees(azimuth))
    along = half @ fixed
    directions = 2.0 * along[:, None] * half - fixed
    return directions, 4.0 * along * weights


def _grid(theta: Doubles, widths: Doubles, phi: Doubles, steps: Doubles) -> tuple[Doubles, Doubles]:
    """Directions of polar angles (m,) and azimuths (m, k), and their solid angles."""
    sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine + 0.0 * phi], axis=-1)
    weights = (widths[:, None] * sine * steps) + 0.0 * phi
    return directions.reshape(-1, 3), weights.reshape(-1)


def trap(
    center: Doubles, half_angle: float, peak: Doubles, rule: Rule = EXACT
) -> tuple[Doubles, Doubles]:
    """Directions in a cone about `center`, (3,), and their solid angles, dense about a `peak`.

    The peak, (3,), is in the cone, whose half angle is in radians; nodes are in polar coordinates
    about the peak.
    """
    apart = math.acos(min(1.0, float(center @ peak)))
    toward = center - (center @ peak) * peak
    length = float(np.linalg.norm(toward))
    if length < 1e-9:  # the cone is centered at the peak: any direction does
        toward = np.cross(peak, [0.0, 1.0, 0.0])
        length = float(np.linalg.norm(toward))
    toward = toward / length
    across = np.cross(peak, toward)
    phi, step = circle(rule.around)
    # cos(half angle) = cos psi cos apart + sin psi sin apart cos phi, solved for psi.
    a, b = math.cos(apart), math.sin(apart) * np.cos(phi)
    most = np.arctan2(b, a) + np.arccos(np.clip(math.cos(half_angle) / np.hypot(a, b), -1.0, 1.0))
    part, widths = graded(0.0, 1.0, 0.0, 1e-3)
    psi = part[:, None] * most
    sine = np.sin(psi)
    directions = (
        np.cos(psi)[..., None] * peak
        + (sine * np.cos(phi))[..., None] * toward
        + (sine * np.sin(phi))[..., None] * across
    )
    weights = widths[:, None] * most * sine * step
    return directions.reshape(-1, 3), weights.reshape(-1)
