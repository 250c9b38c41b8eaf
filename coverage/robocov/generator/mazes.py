"""Maps of the kind `mazes`: corridors on a grid of cells, some dead ends, some ways round.

The passages are a spanning tree of the grid, grown cell by cell ("growing tree": J. Buck, *Mazes for
Programmers*, 2015, chapter 11): from the newest cell it makes long winding corridors, as a depth-first
search does, from any cell many short ones. Some walls are opened after that, those at dead ends first
("braiding").

Walls are a boolean array (columns + 1, rows + 1, 2): whether one leads from a post, where lines of the grid
cross, upwards (0) and to the right (1).
"""

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
import shapely

from robocov.arrays import BoolArray
from robocov.environment import DiscStart, Obstacle, WallObstacle
from robocov.generator.request import AREA_TOLERANCE, Request

Cell: TypeAlias = tuple[int, int]
Post: TypeAlias = tuple[int, int]

_OBLONG = 0.5  # what oblong cells count, against a number of cells that is not the one asked for
_NEWEST = 0.6, 0.98  # least and largest chance with which a maze grows from its newest cell
# least and largest part of the walls that are opened, and the most where the blocked area wants it
_OPENED, _MOST_OPENED = (0.04, 0.12), 0.4
_DEAD_END = 0.7  # chance that the wall to be opened is one at a dead end
_CLOSE = 0.8  # part of the tolerance of the blocked area that is made use of


def maze(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return walls between corridors of one width; None if they are narrower than the gap.

    Walls are as thick as the blocked area wants; what is still too much of it, as thicknesses are rounded,
    goes by opening some more. No wall stands in the disc of the start.
    """
    shape = _shape(request)
    walls = inner_walls(shape) & ~tree_passages(shape, rng)
    least = (1.0 - _MOST_OPENED) * walls.sum()
    for _ in range(round(walls.sum() * rng.uniform(*_OPENED))):
        _open(walls, rng)
    disc = shapely.Point(corner.center).buffer(corner.radius)
    enough = _CLOSE * AREA_TOLERANCE * request.width * request.height
    while walls.any() and walls.sum() >= least:
        lines = list(trails(walls))

        def built(steps: int, lines: list[list[Post]] = lines) -> tuple[list[WallObstacle], float]:
            wide = round(steps * request.step, request.digits)
            x, y = _grid(request, shape, wide)
            found = [WallObstacle(tuple((x[i], y[k]) for i, k in line), wide) for line in lines]
            return found, float(shapely.union_all([wall.polygon for wall in found]).area)

        # the thickness whose blocked area is nearest to what is wanted
        low, high = 1, math.ceil(min(request.width / shape[0], request.height / shape[1]) / request.step)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if built(middle)[1] < request.blocked else (low, middle)
        found, area = min(map(built, (low, high)), key=lambda each: abs(each[1] - request.blocked))
        thickness = found[0].width
        x, y = _grid(request, shape, thickness)
        # the boundary has no thickness
        centred = ([-thickness / 2.0, *line[1:-1], line[-1] + thickness / 2.0] for line in (x, y))
        if min(np.diff(line).min() for line in centred) - thickness < request.gap - 1e-9:
            return None
        at = np.argwhere(walls)
        begin = np.column_stack([np.take(x, at[:, 0]), np.take(y, at[:, 1])])
        end = np.column_stack([np.take(x, at[:, 0] + at[:, 2]), np.take(y, at[:, 1] + 1 - at[:, 2])])
        beside = thickness / 2.0 * np.column_stack([1 - at[:, 2], at[:, 2]])
        inside = shapely.intersects(shapely.box(*(begin - beside).T, *(end + beside).T), disc)
        if inside.any():
            walls[tuple(at[inside].T)] = False
        elif abs(area - request.blocked) <= enough:
            return [*found]
        else:
            _open(walls, rng)
    return None


def _shape(request: Request) -> Cell:
    """Return how many columns and rows there are."""

    def badness(shape: Cell) -> float:
        columns, rows = shape
        oblong = abs(math.log(request.width / columns) - math.log(request.height / rows))
        return abs(math.log(columns * rows / request.obstacles)) + _OBLONG * oblong

    most = int(request.obstacles)
    return min(((c, r) for c in range(1, most + 1) for r in range(1, 2 * most // c + 1)), key=badness)


def _grid(request: Request, shape: Cell, thickness: float) -> list[list[float]]:
    """Return the x and y of the lines, m; the corridors are as wide as each other, along the boundary too."""
    lines = []
    for length, count in zip((request.width, request.height), shape, strict=True):
        inner = np.arange(1, count, dtype=np.float64) * ((length + thickness) / count) - thickness / 2.0
        lines.append([0.0, *request.round_points(inner).tolist(), float(length)])
    return lines


def inner_walls(shape: Cell) -> BoolArray:
    """Return all walls between cells, those of the boundary not."""
    walls = np.zeros((shape[0] + 1, shape[1] + 1, 2), dtype=bool)
    walls[1:-1, :-1, 0] = walls[:-1, 1:-1, 1] = True
    return walls


def tree_passages(shape: Cell, rng: np.random.Generator) -> BoolArray:
    """Return where walls are missing so that there is one way from each cell to each other."""
    newest = rng.uniform(*_NEWEST)
    growing = [(int(rng.integers(shape[0])), int(rng.integers(shape[1])))]
    unreached = {*itertools.product(range(shape[0]), range(shape[1]))} - {*growing}
    passages = np.zeros_like(inner_walls(shape))
    while growing:
        at = len(growing) - 1 if rng.random() < newest else int(rng.integers(len(growing)))
        column, row = growing[at]
        around = (column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1)
        fresh = [cell for cell in around if cell in unreached]
        if fresh:
            cell = fresh[int(rng.integers(len(fresh)))]
            passages[(*max(growing[at], cell), int(column == cell[0]))] = True
            unreached.remove(cell)
            growing.append(cell)
        else:
            growing.pop(at)
    return passages


def _open(walls: BoolArray, rng: np.random.Generator) -> None:
    """Take away a wall, if possible one held at both ends, which makes a way round; often at a dead end."""
    at = np.argwhere(walls)
    along = np.column_stack([at[:, 2], 1 - at[:, 2]])
    posts_and_cells = at[:, :2], at[:, :2] + along, at[:, :2] - along[:, ::-1]
    begin, end, beside = (tuple(each.T) for each in posts_and_cells)
    meeting = np.zeros(walls.shape[:2], dtype=int)
    for posts in (begin, end):
        np.add.at(meeting, posts, 1)
    held = meeting > 1
    held[[0, -1]] = held[:, [0, -1]] = True
    good = held[begin] & held[end]
    good |= not good.any()
    if rng.random() < _DEAD_END:
        passages = inner_walls((walls.shape[0] - 1, walls.shape[1] - 1)) & ~walls
        around = passages[:-1, :-1].sum(axis=2) + passages[1:, :-1, 0] + passages[:-1, 1:, 1]
        # a wall is between the cell whose lower left post it begins at, and the one beside
        dead_end = good & ((around[begin] == 1) | (around[beside] == 1))
        good = dead_end if dead_end.any() else good
    places = np.flatnonzero(good)
    walls[tuple(at[places[int(rng.integers(len(places)))]])] = False


def trails(walls: BoolArray) -> Iterator[list[Post]]:
    """Yield poly-lines that have every wall once, by the posts at their ends and bends.

    They go straight on where they can, and round a corner where nothing else meets there.
    """
    arms: defaultdict[Post, set[Post]] = defaultdict(set)
    for i, k, right in np.argwhere(walls).tolist():
        one, other = (i, k), (i + right, k + 1 - right)
        arms[one].add(other)
        arms[other].add(one)
    done: set[tuple[Post, Post]] = set()

    def straight(before: Post, here: Post) -> Post:
        return 2 * here[0] - before[0], 2 * here[1] - before[1]

    def onward(before: Post, here: Post) -> Post | None:
        others = arms[here] - {before}
        if straight(before, here) in others:
            return straight(before, here)
        return others.pop() if len(others) == 1 else None

    for begin, step in sorted((one, other) for one in arms for other in arms[one]):
        if onward(step, begin) is None and (begin, step) not in done:
            trail, before = [begin], begin
            here: Post | None = step
            while here is not None:
                done |= {(before, here), (here, before)}
                following = onward(before, here)
                if following != straight(before, here):
                    trail.append(here)
                before, here = here, following
            yield trail
