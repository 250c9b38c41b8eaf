"""Pieces of boundary that are circular arcs or segments, and what they enclose, in closed form.

A piece is a row x, y, u, v, a: its ends (m), and half of the angle that it spans about its circle's centre,
from -pi/2 to pi/2, positive where it turns left. Zero is a segment, and an arc that is almost one loses no
digit, however large its radius. Green's theorem asks for the triangle that the chord spans with the
origin, and for the circular segment between chord and arc. What is enclosed lies to the left.
"""

from __future__ import annotations

from math import comb

import numpy as np

from robocov.arrays import Array
from robocov.compiled import inner_kernel, kernel

_SERIES_BELOW = 0.04
"""sin² of the half angle below which the series is taken: the closed form divides rounding by it."""

_SERIES = np.array([2.0 * comb(2 * m, m) / 4.0**m / (2 * m + 3) for m in range(13, 0, -1)])
"""Of (x - sin x cos x - 2/3 sin³ x) / sin⁵ x by powers of sin² x, the highest first."""


@kernel
def _moments(pieces: Array, n: int, series: Array) -> Array:
    sums = np.zeros((n, 4))
    for k in range(len(pieces)):
        x, y, u, v = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        cross = x * v - u * y
        middle_x, middle_y = 0.5 * (x + u), 0.5 * (y + v)
        # to the right of the chord, as long as it is
        out_x, out_y = v - y, x - u
        square = out_x * out_x + out_y * out_y
        area, lever, spread = _segment(pieces[k, 4], series)
        area, lever, spread = area * square, lever * square, spread * square * square
        i = int(pieces[k, 5])
        sums[i, 0] += 0.5 * cross + area
        sums[i, 1] += middle_x * (cross / 3.0 + area) + lever * out_x
        sums[i, 2] += middle_y * (cross / 3.0 + area) + lever * out_y
        ends = x * (x + u) + u * u + y * (y + v) + v * v
        along = lever * (middle_x * out_x + middle_y * out_y)
        away = middle_x * middle_x + middle_y * middle_y
        sums[i, 3] += cross * ends / 12.0 + spread + 2.0 * along + area * away
    return sums


@inner_kernel
def _segment(half_angle: float, series: Array) -> tuple[float, float, float]:
    """Return area, lever and spread of the circular segment on a chord of length 1.

    The lever is the first moment about the chord's line, away from the centre; the spread is the polar
    moment about the middle of the chord. With s and c the sine and cosine of the half angle x, and
    h = (x - s c - 2/3 s³) / s⁵, which is 1/5 at zero, all three are sums of terms that do not cancel.
    """
    s, c = np.sin(half_angle), np.cos(half_angle)
    square = s * s
    if square > _SERIES_BELOW:
        h = ((half_angle - s * c) / s**3 - 2.0 / 3.0) / square
    else:
        h = 0.0
        for coefficient in series:
            h = h * square + coefficient
    area = s * (2.0 / 3.0 + square * h) / 4.0
    lever = square * (2.0 / 3.0 / (1.0 + c) - c * h) / 8.0
    return area, lever, s * (1.0 / (1.0 + c) - 2.0 / 3.0 + (1.5 - square) * h) / 16.0


def moments(pieces: Array, n: int) -> Array:
    """Return area (m²), first moments x and y (m³) and polar moment (m⁴) of n cells, (n, 4).

    `pieces` (p, 6 or more) are the boundaries; the sixth number is the cell about whose origin each is.
    """
    return np.asarray(_moments(np.ascontiguousarray(pieces), n, _SERIES))


def chords(pieces: Array, sagitta: float) -> list[Array]:
    """Return each piece as a line of chords, (k, 2) m with both ends, at most `sagitta` from it."""
    lines = []
    for x, y, u, v, half_angle in pieces[:, :5].tolist():
        radius = 0.5 * np.hypot(u - x, v - y) / max(abs(np.sin(half_angle)), 1e-300)
        parts = 1
        if radius * half_angle**2 >= 2.0 * sagitta:
            # a chord of half angle x leaves its arc by r (1 - cos x)
            step = np.sqrt(2.0 * min(sagitta / max(radius, 1e-300), 0.5))
            parts = int(np.ceil(abs(half_angle) / max(step, 1e-3)))
        if parts == 1:
            lines.append(np.array([[x, y], [u, v]]))
            continue
        angle = half_angle * np.linspace(-1.0, 1.0, parts + 1)
        rise = 0.5 * (np.cos(angle) - np.cos(half_angle)) / np.sin(half_angle)
        run = 0.5 + 0.5 * np.sin(angle) / np.sin(half_angle)
        line = np.column_stack([x + run * (u - x) + rise * (v - y), y + run * (v - y) + rise * (x - u)])
        line[0], line[-1] = (x, y), (u, v)
        lines.append(line)
    return lines


def rings(pieces: Array, sagitta: float) -> list[Array]:
    """Return the closed lines that pieces in any order make up, as polygons, (k, 2) m each.

    Outlines run counter-clockwise, those of holes clockwise. Every piece ends where another one begins, up
    to rounding; the polygons leave the arcs by at most `sagitta` (m).
    """
    lines, left, found = chords(pieces, sagitta), list(range(len(pieces))), []
    while left:
        first = k = left.pop(0)
        ring = [lines[k][:-1]]
        while True:
            home = np.hypot(*(pieces[first, :2] - pieces[k, 2:4]))
            away = np.hypot(*(pieces[left, :2] - pieces[k, 2:4]).T)
            if not left or home <= away.min():
                break
            k = left.pop(int(away.argmin()))
            ring.append(lines[k][:-1])
        found.append(np.concatenate(ring))
    return found
