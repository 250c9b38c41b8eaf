"""Hues of robots and of their cells, and the colors of trajectories.

In a small team each robot has its own hue. Viewers cannot tell more than nine hues apart, so the cells of a
larger team are colored like the countries of a map: only cells that share an edge must differ.
"""

from heapq import heapify, heappop, heappush
from typing import Literal, TypeAlias

import numpy as np

from robocov.typing import IntArray
from robocov_app.look.colors import Color, compute_contrast, mix
from robocov_app.look.theme import Theme

MAX_OWN_HUES = 9
"""Maximum number of robots that each have a hue of their own."""
N_SHARED_HUES = 6
"""Number of hues in a larger team."""
_MAX_VISITS = 6
"""Maximum number of changes of the hue of one cell before the repair of hues is given up."""
MIN_TRAIL_CONTRAST = 2.4
"""Minimum contrast ratio between the trajectory of a robot and its cell."""
_MIN_TRAIL_INK_FRACTION = 0.12
_TRAIL_INK_STEP = 0.04
"""Fraction of ink in the color of a trajectory: the minimum, and the step by which it grows."""
_CROWDED_TRAIL_BACKGROUND_FRACTION = 0.25
"""Fraction of the background in the color of the trajectories of a large team."""

ColorScheme: TypeAlias = Literal["paper", "robots"]
"""Colors of robots and trajectories.

"robots" gives each robot its own hue, so that single robots can be followed. "paper" uses the colors of the
article: green starts, red trajectories and blue final positions, which are legible in small pictures.
"""


def choose_robot_hues(
    n: int, adjacency: IntArray | None = None, previous: IntArray | None = None
) -> IntArray:
    """Choose the hue of each robot and of its cell.

    Parameters
    ----------
    n : int
        Number of robots.
    adjacency : (m, 2) int array, optional
        Pairs of robots whose cells share an edge. Their hues differ if possible.
    previous : (n,) int array, optional
        Hues in the previous frame, which change as little as possible, so that cells do not flicker.

    Returns
    -------
    (n,) int array
        Indices into `Theme.robots`. Up to `MAX_OWN_HUES` robots have different ones; in larger teams, they
        are below `N_SHARED_HUES`.
    """
    if n <= MAX_OWN_HUES:
        return np.arange(n, dtype=np.intp)
    if previous is not None and len(previous) != n:
        previous = None
    if adjacency is None:
        return np.arange(n, dtype=np.intp) % N_SHARED_HUES if previous is None else previous
    if previous is not None:
        repaired = _repair_hues(previous.copy(), adjacency)
        if repaired is not None:
            return repaired
    return _color_graph(n, adjacency)


def _repair_hues(hues: IntArray, adjacency: IntArray) -> IntArray | None:
    """Change the hues of cells that have the same hue as a neighbor, and of few others.

    `hues`, (n,), is changed in place and returned; None means that the repair did not converge.
    """
    visits = np.zeros(len(hues), dtype=int)
    flat = adjacency.ravel()
    hue_pairs = hues[adjacency]
    is_conflict = hue_pairs[:, 0] == hue_pairs[:, 1]
    cells_to_check = np.unique(adjacency[is_conflict]).tolist()
    while cells_to_check:
        cell = cells_to_check.pop()
        # Flat indices 2 k and 2 k + 1 are the ends of edge k, so flipping the last bit gives the other end.
        neighbors = flat[np.flatnonzero(flat == cell) ^ 1]
        neighbor_hues = hues[neighbors].tolist()
        if hues[cell] not in neighbor_hues:
            continue
        visits[cell] += 1
        if visits[cell] > _MAX_VISITS:
            return None
        offset = cell + int(visits[cell])
        # Break ties differently at each visit, otherwise two cells could swap hues forever.
        hues[cell] = min(
            range(N_SHARED_HUES),
            key=lambda hue: (neighbor_hues.count(hue), (hue + offset) % N_SHARED_HUES),
        )
        cells_to_check += neighbors[hues[neighbors] == hues[cell]].tolist()
    return hues


def _color_graph(n: int, adjacency: IntArray) -> IntArray:
    """Color the graph of adjacent cells by DSATUR, with all hues used about equally often.

    DSATUR (Brelaz, 1979) always colors next the vertex whose neighbors have the most different colors. If
    they have all colors, the vertex gets the color that is rarest among them.
    """
    neighbors: list[list[int]] = [[] for _ in range(n)]
    for first, second in adjacency.tolist():
        neighbors[first].append(second)
        neighbors[second].append(first)
    hues = [-1] * n
    uses = [0] * N_SHARED_HUES
    neighbor_hues: list[set[int]] = [set() for _ in range(n)]
    # Heap of (-saturation, -degree, vertex). Coloring a neighbor outdates an entry, which is skipped later.
    waiting = [(0, -len(neighbors[vertex]), vertex) for vertex in range(n)]
    heapify(waiting)
    while waiting:
        saturation, _, vertex = heappop(waiting)
        if hues[vertex] >= 0 or -saturation < len(neighbor_hues[vertex]):
            continue
        taken = [hues[neighbor] for neighbor in neighbors[vertex]]
        hue = min(range(N_SHARED_HUES), key=lambda hue: (taken.count(hue), uses[hue], hue))
        hues[vertex] = hue
        uses[hue] += 1
        for neighbor in neighbors[vertex]:
            if hues[neighbor] < 0 and hue not in neighbor_hues[neighbor]:
                neighbor_hues[neighbor].add(hue)
                heappush(waiting, (-len(neighbor_hues[neighbor]), -len(neighbors[neighbor]), neighbor))
    return np.array(hues, dtype=np.intp)


def choose_trail_colors(theme: Theme, hues: list[int], scheme: ColorScheme) -> list[Color]:
    """Choose the color of the trajectory of each robot.

    In a team that is too large for one hue per robot, trajectories could have the colors of the cells that
    they cross. So they are all red, as in the scheme of the paper, but paler, since there are many.

    Parameters
    ----------
    theme : Theme
    hues : list of int
        Hue of each robot; see `choose_robot_hues`.
    scheme : {"paper", "robots"}

    Returns
    -------
    list of Color
    """
    if scheme == "paper":
        return [theme.trajectory] * len(hues)
    if len(hues) > MAX_OWN_HUES:
        color = mix(theme.trajectory, theme.background, _CROWDED_TRAIL_BACKGROUND_FRACTION)
        return [color] * len(hues)
    return [choose_trail_color(theme, hue) for hue in hues]


def choose_trail_color(theme: Theme, hue: int) -> Color:
    """Choose the color of a trajectory: the robot's hue, mixed with ink until it contrasts with the cell."""
    cell_color = theme.get_cell_color(hue)
    fraction = _MIN_TRAIL_INK_FRACTION
    color = mix(theme.robots[hue], theme.ink, fraction)
    while compute_contrast(color, cell_color) < MIN_TRAIL_CONTRAST:
        fraction += _TRAIL_INK_STEP
        color = mix(theme.robots[hue], theme.ink, fraction)
    return color
