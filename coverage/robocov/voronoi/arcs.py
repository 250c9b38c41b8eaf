"""Pieces of boundary that are circular arcs or segments, and what they enclose, in closed form.

A piece is stored by its two ends and the signed half of the angle that it spans about its circle's centre.
Zero is a segment, and an arc that is almost one loses no digit, however large its radius. What Green's
theorem asks of a piece is the triangle that its chord spans with the origin, and the circular segment
between chord and arc.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array

_SERIES_BELOW = 0.04
"""sin² of the half angle below which the series is taken: the closed form divides rounding by it."""

_SERIES = tuple(2.0 * comb(2 * m, m) / 4.0**m / (2 * m + 3) for m in range(13, 0, -1))
"""Of (x - sin x cos x - 2/3 sin³ x) / sin⁵ x by powers of sin² x, the highest first."""


class Arcs(NamedTuple):
    """Pieces of boundary, m of them, each with the area that it bounds to its left.

    Attributes
    ----------
    start, end : (m, 2) m
    half_angle : (m,) rad
        Half of the angle that the piece spans about its circle's centre, from -pi/2 to pi/2: positive
        where it turns left, so that it bulges out, negative where it turns right, zero on a segment.
    """

    start: Array
    end: Array
    half_angle: Array

    def moments(self) -> tuple[Array, Array, Array]:
        """Return what each piece adds to the area, and to the first and polar moments about the origin.

        Returns
        -------
        area : (m,) m²
        first : (m, 2) m³
        polar : (m,) m⁴
            Their sums over a whole boundary are the integrals of 1, q and |q|² over what it encloses.
        """
        (x, y), (u, v) = self.start.T, self.end.T
        cross = x * v - u * y
        middle = 0.5 * (self.start + self.end)
        # to the right of the chord, as long as it is
        out = np.column_stack([v - y, x - u])
        square = out[:, 0] ** 2 + out[:, 1] ** 2
        bulge, lever, spread = _segment(self.half_angle)
        bulge, spread = bulge * square, spread * square * square
        lever = lever[:, None] * square[:, None] * out
        area = 0.5 * cross + bulge
        first = middle * (cross / 3.0 + bulge)[:, None] + lever
        ends = x * (x + u) + u * u + y * (y + v) + v * v
        away = middle[:, 0] ** 2 + middle[:, 1] ** 2
        along = middle[:, 0] * lever[:, 0] + middle[:, 1] * lever[:, 1]
        return area, first, cross * ends / 12.0 + spread + 2.0 * along + bulge * away

    def points(self, sagitta: float) -> list[Array]:
        """Return each piece as a line of chords, (k, 2) m with both ends, at most `sagitta` from it."""
        out = np.column_stack([self.end[:, 1] - self.start[:, 1], self.start[:, 0] - self.end[:, 0]])
        sine = np.sin(self.half_angle)
        radius = 0.5 * np.hypot(out[:, 0], out[:, 1]) / np.maximum(np.abs(sine), 1e-300)
        # a chord of half angle x leaves its arc by r (1 - cos x)
        step = np.sqrt(2.0 * np.minimum(sagitta / np.maximum(radius, 1e-300), 0.5))
        count = np.maximum(np.ceil(np.abs(self.half_angle) / np.maximum(step, 1e-3)), 1.0)
        count[np.abs(radius * self.half_angle**2) < 2.0 * sagitta] = 1.0
        lines = []
        for k, parts in enumerate(count.astype(int).tolist()):
            if parts == 1:
                lines.append(np.stack([self.start[k], self.end[k]]))
                continue
            angle = self.half_angle[k] * np.linspace(-1.0, 1.0, parts + 1)
            middle = 0.5 * (self.start[k] + self.end[k])
            rise = 0.5 * (np.cos(angle) - np.cos(self.half_angle[k])) / sine[k]
            run = 0.5 * np.sin(angle) / sine[k]
            along = self.end[k] - self.start[k]
            line = middle + run[:, None] * along + rise[:, None] * out[k]
            line[0], line[-1] = self.start[k], self.end[k]
            lines.append(line)
        return lines


def rings(arcs: Arcs, sagitta: float) -> list[Array]:
    """Return the closed lines that pieces in any order make up, as polygons, (k, 2) m each.

    What the pieces enclose lies to the left: outlines run counter-clockwise, those of holes clockwise.

    Parameters
    ----------
    arcs : Arcs
        Every piece ends where another one begins, up to rounding.
    sagitta : float, m
        How far a polygon may leave its arcs.
    """
    lines = arcs.points(sagitta)
    left = list(range(len(lines)))
    found = []
    while left:
        first = k = left.pop(0)
        ring = [lines[k][:-1]]
        while True:
            home = np.hypot(*(arcs.start[first] - arcs.end[k]))
            away = arcs.start[left] - arcs.end[k]
            distance = np.hypot(away[:, 0], away[:, 1])
            if not left or home <= distance.min():
                break
            k = left.pop(int(distance.argmin()))
            ring.append(lines[k][:-1])
        found.append(np.concatenate(ring))
    return found


def _segment(half_angle: Array) -> tuple[Array, Array, Array]:
    """Return area, lever and spread of circular segments with a chord of length 1, (m,) each.

    The lever is the first moment about the chord's line, away from the centre; the spread is the polar
    moment about the middle of the chord. With s and c the sine and cosine of the half angle x, and
    h = (x - s c - 2/3 s³) / s⁵, which is 1/5 at zero, all three are sums of terms that do not cancel.
    """
    s, c = np.sin(half_angle), np.cos(half_angle)
    square = s * s
    h = np.full_like(square, _SERIES[0])
    for coefficient in _SERIES[1:]:
        h *= square
        h += coefficient
    wide = (square > _SERIES_BELOW).nonzero()[0]
    x, t = half_angle[wide], s[wide]
    h[wide] = ((x - t * c[wide]) / t**3 - 2.0 / 3.0) / square[wide]
    area = s * (2.0 / 3.0 + square * h) / 4.0
    lever = square * (2.0 / 3.0 / (1.0 + c) - c * h) / 8.0
    spread = s * (1.0 / (1.0 + c) - 2.0 / 3.0 + (1.5 - square) * h) / 16.0
    return area, lever, spread
