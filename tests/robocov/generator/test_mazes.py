"""Mazes: their walls and the free space between them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import Point

from robocov.environment import Environment, WallObstacle, find_narrowest_gap
from robocov.generator import generate_map
from robocov.generator.mazes import find_inner_walls, grow_passages, trace_polylines


def count_components(count: int, pairs: list[tuple[int, int]]) -> int:
    """Return the number of connected components of `count` nodes that are joined in pairs."""
    group = list(range(count))
    for i, j in pairs:
        group = [group[i] if number == group[j] else number for number in group]
    return len(set(group))


@settings(max_examples=count_examples(60))
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32))
def test_passages_connect_all_cells_without_loops(columns: int, rows: int, seed: int) -> None:
    passages = grow_passages((columns, rows), np.random.default_rng(seed))
    inner = find_inner_walls((columns, rows))
    assert inner.sum() == 2 * columns * rows - columns - rows
    assert not (passages & ~inner).any()
    assert passages.sum() == columns * rows - 1
    number = {cell: k for k, cell in enumerate(itertools.product(range(columns), range(rows)))}
    pairs = []
    for i, k, right in np.argwhere(passages).tolist():
        # A vertical wall is between a cell and the one to its left.
        neighbor = (i, k - 1) if right else (i - 1, k)
        pairs.append((number[i, k], number[neighbor]))
    assert count_components(columns * rows, pairs) == 1


def build_forest(pieces: set) -> set:
    """Return pieces of walls without closed rings, since no maze encloses a cell."""
    posts = sorted({post for piece in pieces for post in piece})
    forest: set = set()
    for piece in sorted(pieces):
        pairs = [(posts.index(a), posts.index(b)) for a, b in (*forest, piece)]
        if count_components(len(posts), pairs) == len(posts) - len(pairs):
            forest.add(piece)
    return forest


def split_into_pieces(polyline: list[tuple[int, int]]) -> list[tuple]:
    """Return the pieces of walls between adjacent posts along a polyline."""
    pieces = []
    for (x, y), (u, v) in itertools.pairwise(polyline):
        assert (x == u) != (y == v)
        steps = max(abs(u - x), abs(v - y))
        line = [(x + (u - x) * k // steps, y + (v - y) * k // steps) for k in range(steps + 1)]
        pieces += [tuple(sorted(pair)) for pair in itertools.pairwise(line)]
    return pieces


@settings(max_examples=count_examples(60))
@given(st.sets(st.tuples(st.integers(0, 5), st.integers(0, 5), st.booleans()), max_size=40))
def test_polylines_contain_every_wall_of_a_forest_once(drawn: set[tuple[int, int, bool]]) -> None:
    forest = build_forest({((x, y), (x + 1, y) if flat else (x, y + 1)) for x, y, flat in drawn})
    pieces = []
    walls = np.zeros((7, 7, 2), dtype=bool)
    for (x, y), (u, _) in forest:
        walls[x, y, u - x] = True
    for polyline in trace_polylines(walls):
        pieces += split_into_pieces(polyline)
        # There is a bend at every post between the ends.
        for a, b, c in zip(polyline, polyline[1:], polyline[2:], strict=False):
            assert (b[0] - a[0]) * (c[1] - b[1]) != (b[1] - a[1]) * (c[0] - b[0])
    assert len(pieces) == len(set(pieces))
    assert set(pieces) == forest


def summarize_walls(environment: Environment) -> tuple[int, set[float]]:
    """Return the number of walls and their widths."""
    walls = [wall for wall in environment.obstacles if isinstance(wall, WallObstacle)]
    assert len(walls) == len(environment.obstacles)
    return len(walls), {wall.width for wall in walls}


@pytest.mark.parametrize("seed", range(8))
def test_walls_are_of_one_thickness_and_corridors_of_one_width(seed: int) -> None:
    environment = generate_map(seed, kind="mazes", obstacles=64, area=0.15)
    count, (thickness,) = summarize_walls(environment)
    gap = find_narrowest_gap(environment.free)
    assert gap is not None
    # Eight corridors and seven walls side by side, on whole centimeters.
    assert gap.width == pytest.approx((10.0 - 7 * thickness) / 8, abs=0.011)
    assert 10 < count < 49
    assert sum(len(wall.points) for wall in environment.obstacles) < 3 * count + 10  # type: ignore[union-attr]


@pytest.mark.slow
def test_mazes_have_dead_ends_and_loops() -> None:
    for seed in range(20):
        environment = generate_map(seed, kind="mazes")
        (free,) = environment.free.geoms
        # The free space has one hole for each loop.
        assert 1 <= len(free.interiors) <= 8
        (thickness,) = {wall.width for wall in environment.obstacles}  # type: ignore[union-attr]
        pitch = (10.0 + thickness) / 6
        centers = pitch * (np.arange(6) + 0.5) - thickness / 2.0
        solid = shapely.union_all([wall.polygon for wall in environment.obstacles])
        blocked = solid.buffer(0.02) | (shapely.box(-1, -1, 11, 11) - shapely.box(0, 0, 10, 10))
        sides = pitch / 2.0 * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
        walls_around = [
            int(shapely.contains_xy(blocked, *(center + sides).T).sum())
            for center in np.stack(np.meshgrid(centers, centers), axis=-1).reshape(-1, 2)
        ]
        assert walls_around.count(4) == 0
        assert walls_around.count(3) >= 1


@pytest.mark.parametrize(
    ("obstacles", "width", "height", "cells"),
    [(36, 10.0, 10.0, (6, 6)), (12, 20.0, 15.0, (4, 3)), (30, 20.0, 8.0, (10, 3)), (37, 10.0, 10.0, (6, 6))],
)
def test_the_grid_has_about_the_requested_number_of_cells(
    obstacles: int, width: float, height: float, cells: tuple[int, int]
) -> None:
    lines: tuple[set[int], set[int]] = (set(), set())
    for seed in range(6):
        environment = generate_map(
            seed, kind="mazes", obstacles=obstacles, area=0.1, width=width, height=height
        )
        assert f"about {obstacles} cells" in environment.description
        for wall in environment.obstacles:
            for a, b in itertools.pairwise(wall.points):  # type: ignore[union-attr]
                axis = int(a[1] == b[1])
                pitch = ((width, height)[axis] + wall.width) / cells[axis]  # type: ignore[union-attr]
                line = (a[axis] + wall.width / 2.0) / pitch  # type: ignore[union-attr]
                assert line == pytest.approx(round(line), abs=0.01)
                lines[axis].add(round(line))
    assert lines == (set(range(1, cells[0])), set(range(1, cells[1])))


@pytest.mark.slow
def test_starts_contain_no_walls() -> None:
    for seed in range(12):
        # The corridors are narrower than the disc.
        environment = generate_map(seed, kind="mazes", obstacles=144, area=0.15)
        start = environment.starts["corner"]
        assert start.radius == 0.6  # type: ignore[union-attr]
        assert environment.free.contains(Point(start.center).buffer(0.6))  # type: ignore[union-attr]
