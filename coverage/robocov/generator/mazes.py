"""Maps of the kind `mazes`: corridors on a grid of cells, some dead ends, some ways round.

The passages are a spanning tree of the grid, grown cell by cell ("growing tree": J. Buck, *Mazes for
Programmers*, 2015, chapter 11): from the newest cell it makes long winding corridors, as a depth-first
search does, from any cell many short ones; each maze mixes the two. In a tree there is one way from place
to place. So some walls are opened after that, those at dead ends first ("braiding").
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import shapely

from robocov.environment import WallObstacle
from robocov.generator.request import AREA_TOLERANCE

if TYPE_CHECKING:
    from robocov.environment import Obstacle
    from robocov.environment.starts import DiscStart
    from robocov.generator.request import Request

Cell: TypeAlias = tuple[int, int]
"""Column and row."""

Post: TypeAlias = tuple[int, int]
"""Where lines of the grid cross: the numbers of the vertical and of the horizontal one."""

Piece: TypeAlias = tuple[Post, Post]
"""A wall between two neighbouring posts, the lower first."""

_OBLONG = 0.5
"""What cells that are longer than wide count, against a number of cells that is not the one asked for."""

_NEWEST = 0.6, 0.98
"""Least and largest chance with which a maze grows from its newest cell."""

_OPENED, _MOST_OPENED = (0.04, 0.12), 0.4
"""Least and largest part of the walls that are opened, and the most where the blocked area wants it."""

_DEAD_END = 0.7
"""Chance that the wall to be opened is one at a dead end."""

_CLOSE = 0.8
"""Part of the tolerance of the blocked area that is made use of."""


@dataclass(frozen=True)
class _Grid:
    """The lines of a maze.

    Attributes
    ----------
    x, y : tuple of float, m
        Of the vertical and the horizontal ones; the first and the last are the boundary.
    thickness : float, m
        Of the walls on them.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    thickness: float

    @classmethod
    def of(cls, request: Request, shape: Cell, thickness: float) -> _Grid:
        """Return the grid whose corridors are as wide as each other, also those along the boundary."""

        def lines(length: float, count: int) -> tuple[float, ...]:
            inner = np.arange(1, count, dtype=np.float64) * ((length + thickness) / count) - thickness / 2.0
            return (0.0, *request.rounded(inner).tolist(), float(length))

        return cls(lines(request.width, shape[0]), lines(request.height, shape[1]), thickness)

    @property
    def narrowest(self) -> float:
        """The width of the narrowest corridor, m."""
        half = self.thickness / 2.0
        faces = []
        for first, *inner, last in (self.x, self.y):
            low, high = [first, *(at + half for at in inner)], [*(at - half for at in inner), last]
            faces += [end - begin for begin, end in zip(low, high, strict=True)]
        return min(faces)

    def walls(self, pieces: set[Piece]) -> list[WallObstacle]:
        """Return the walls, each as long as can be."""
        return [
            WallObstacle(tuple((self.x[i], self.y[k]) for i, k in trail), self.thickness)
            for trail in _trails(pieces)
        ]

    def blocked(self, pieces: set[Piece]) -> float:
        """Return the area that they block, m²."""
        return float(shapely.union_all([wall.polygon for wall in self.walls(pieces)]).area)


def maze(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return walls between corridors of one width; None if they are narrower than the gap.

    The number of cells is the nearest to what was asked for that a grid of nearly square ones has. Walls
    are as thick as the blocked area wants. What is still too much of it, as thicknesses are whole
    centimetres, goes by opening some more. No wall stands in the disc of the start.
    """
    shape = _shape(request)
    pieces = _walls(shape, _tree(shape, rng))
    least = (1.0 - _MOST_OPENED) * len(pieces)
    for _ in range(round(len(pieces) * rng.uniform(*_OPENED))):
        _open(pieces, shape, rng)
    disc = shapely.Point(corner.center).buffer(corner.radius)
    enough = _CLOSE * AREA_TOLERANCE * request.width * request.height
    while pieces and len(pieces) >= least:
        grid = _fitted(request, shape, pieces)
        if grid.narrowest < request.gap - 1e-9:
            return None
        inside = {piece for piece in pieces if grid.walls({piece})[0].polygon.intersects(disc)}
        if inside:
            pieces -= inside
        elif abs(grid.blocked(pieces) - request.blocked) <= enough:
            return [*grid.walls(pieces)]
        else:
            _open(pieces, shape, rng)
    return None


def _shape(request: Request) -> Cell:
    """Return how many columns and rows there are."""

    def badness(shape: Cell) -> float:
        columns, rows = shape
        oblong = abs(math.log(request.width / columns) - math.log(request.height / rows))
        return abs(math.log(columns * rows / request.obstacles)) + _OBLONG * oblong

    most = int(request.obstacles)
    return min(((c, r) for c in range(1, most + 1) for r in range(1, 2 * most // c + 1)), key=badness)


def _fitted(request: Request, shape: Cell, pieces: set[Piece]) -> _Grid:
    """Return the grid with the thickness whose blocked area is nearest to what is wanted."""

    def grid(steps: int) -> _Grid:
        return _Grid.of(request, shape, round(steps * request.step, request.digits))

    low, high = 1, math.ceil(min(request.width / shape[0], request.height / shape[1]) / request.step)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if grid(middle).blocked(pieces) < request.blocked else (low, middle)
    return min(map(grid, (low, high)), key=lambda each: abs(each.blocked(pieces) - request.blocked))


def _neighbours(cell: Cell, shape: Cell) -> list[Cell]:
    column, row = cell
    around = [(column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1)]
    return [(c, r) for c, r in around if 0 <= c < shape[0] and 0 <= r < shape[1]]


def _tree(shape: Cell, rng: np.random.Generator) -> set[Piece]:
    """Return where walls are missing so that there is one way from each cell to each other."""
    newest = rng.uniform(*_NEWEST)
    first = (int(rng.integers(shape[0])), int(rng.integers(shape[1])))
    growing, reached, passages = [first], {first}, set()
    while growing:
        at = len(growing) - 1 if rng.random() < newest else int(rng.integers(len(growing)))
        fresh = [cell for cell in _neighbours(growing[at], shape) if cell not in reached]
        if not fresh:
            growing.pop(at)
            continue
        cell = fresh[int(rng.integers(len(fresh)))]
        passages.add(_between(growing[at], cell))
        reached.add(cell)
        growing.append(cell)
    return passages


def _between(one: Cell, other: Cell) -> Piece:
    """Return where the wall between two neighbouring cells is."""
    column, row = max(one, other)
    return (column, row), ((column, row + 1) if one[1] == other[1] else (column + 1, row))


def _around(cell: Cell, shape: Cell) -> set[Piece]:
    """Return where walls to neighbouring cells are."""
    return {_between(cell, other) for other in _neighbours(cell, shape)}


def _walls(shape: Cell, passages: set[Piece]) -> set[Piece]:
    every = (_around((column, row), shape) for column in range(shape[0]) for row in range(shape[1]))
    return set().union(*every) - passages


def _open(pieces: set[Piece], shape: Cell, rng: np.random.Generator) -> None:
    """Take away a wall, one at a dead end if there is any and chance has it.

    If possible it is one that joins others, or joins them to the boundary: then there is a way round what
    it held. To take the end of a wall makes none.
    """
    arms = _arms(pieces)
    joining = {piece for piece in pieces if all(len(arms[post]) > 1 or _outer(post, shape) for post in piece)}
    candidates = joining or pieces
    if rng.random() < _DEAD_END:
        around = [_around((column, row), shape) for column in range(shape[0]) for row in range(shape[1])]
        at_dead_ends = [each & candidates for each in around if len(each - pieces) == 1]
        candidates = set().union(*at_dead_ends) or candidates
    pieces.remove(sorted(candidates)[int(rng.integers(len(candidates)))])


def _outer(post: Post, shape: Cell) -> bool:
    return post[0] in (0, shape[0]) or post[1] in (0, shape[1])


def _arms(pieces: set[Piece]) -> defaultdict[Post, set[Post]]:
    """Return the posts to which walls lead from each."""
    arms: defaultdict[Post, set[Post]] = defaultdict(set)
    for one, other in pieces:
        arms[one].add(other)
        arms[other].add(one)
    return arms


def _trails(pieces: set[Piece]) -> Iterator[list[Post]]:
    """Yield poly-lines that have every piece once, with their ends and bends.

    They go straight on where they can, and round a corner where nothing else meets there.
    """
    arms = _arms(pieces)

    def onward(before: Post, here: Post) -> Post | None:
        straight = (2 * here[0] - before[0], 2 * here[1] - before[1])
        others = arms[here] - {before}
        if straight in others:
            return straight
        return next(iter(others)) if len(others) == 1 else None

    left = set(pieces)
    for begin in sorted(arms):
        for step in sorted(arms[begin]):
            if onward(step, begin) is not None or tuple(sorted((begin, step))) not in left:
                continue
            trail, before, here = [begin], begin, step
            while True:
                left.discard((min(before, here), max(before, here)))
                following = onward(before, here)
                if following is None:
                    break
                if following != (2 * here[0] - before[0], 2 * here[1] - before[1]):
                    trail.append(here)
                before, here = here, following
            yield [*trail, here]
