"""Measure the goals of the controller `atlas` that the benchmark's tracks do not cover.

    python tests/bench/bench_atlas.py doors large-maps hard-maps corridors sizes --controller atlas-shared
    python tests/bench/bench_atlas.py ranges stakes rest pace --controller atlas-shared

- ``doors``: whether robots find narrow doors in walls of random direction
- ``large-maps``: the same in upright walls on larger maps, where nodes of planners are farther apart
- ``hard-maps``: costs and rest in tunnels, behind narrow doors, next to a notch, and of three robots in rooms
- ``corridors``: gaps in spiral corridors and between nested walls, with and without limited communication
- ``sizes``: whether a larger team is ever worse than a smaller one
- ``ranges``: gaps, rest and path lengths with limited ranges, next to `rapf`
- ``stakes``: costs and path lengths for different values of the gain `stake`, on maps outside the benchmark
- ``rest``: whether a team that has rested for ten minutes responds to a failure and to an open door
- ``pace``: computing time, next to `rapf`
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from robocov import (
    Conditions,
    CoverageCost,
    DiscStart,
    Environment,
    Failure,
    Simulation,
    Team,
    find_optimum,
    generate_map,
    load_map,
    make_controller,
)
from robocov.environment import WallObstacle
from robocov.errors import format_count
from robocov.metrics import compute_path_lengths, find_settling_time
from robocov.typing import FloatArray
from robocov_app.benchmark import suite
from robocov_app.benchmark.results import find_reference

REFERENCE_CONTROLLER = "rapf"
ROBOT_RADIUS_M = 0.1
SHORT_RANGE_M = 3.0

SQUARE_SIDE_M = 8.0
"""Side of the square with a wall through its center."""
WALL_WIDTH_M = 0.1
DOOR_WIDTH_RANGE = (1.6, 3.0)
"""Range of the widths of random doors, in diameters of a robot."""
MAX_DOOR_OFFSET_M = 1.5
"""Maximum distance of a door from the center of its wall."""
MAX_CROSSING_TIME_S = 30.0
SIDES_M = (8.0, 16.0, 25.0, 40.0)
"""Sides of larger squares."""
DOOR_WIDTHS_M = (0.4, 0.5, 0.6)
DOORS_PER_WIDTH = 5
MAX_LARGE_MAP_TIME_S = 120.0
CROSSED_DISTANCE_M = 0.15
"""A robot has crossed the wall if its center is this far behind the wall's center line."""

GRID_SIDE_M = 25.6
"""Side of the square that is divided into equal rooms."""
GRID_ROOMS = 4
"""Number of rooms along a side of this square."""
GRID_DOOR_WIDTH_M = 0.4
MAX_GRID_DOOR_OFFSET_M = 1.5
"""Maximum distance of a door from the center of the wall between two rooms."""
GRID_SEED = 1
HARD_MAP_LATTICE = 64
REFERENCE_RESTARTS = 12
"""Number of restarts of the search for the best placement on each of the hard maps."""
RIVAL_CONTROLLER = "greedy-submodular"

SQUARE_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
"""Corners of a square with sides of length 2, counterclockwise from the lower left one."""
CORRIDOR_WALL_WIDTH_M = 0.12
SPIRAL_CASES = (
    (11.0, 1.5, 1),
    (9.0, 1.3, 2),
    (11.0, 1.5, 2),
    (13.0, 1.7, 2),
    (13.0, 1.45, 4),
)
"""Side of the hall (m), distance between walls (m) and number of arms; see `build_square_spiral`."""
MIN_SPIRAL_HALF_SIDE_M = 0.9
"""Minimum of half the side of the square without walls in the middle of a spiral."""
NESTED_CASES = (
    (11.0, 1.4, ((1, 0.0), (3, 0.0), (1, 0.0))),
    (12.0, 1.5, ((0, 3.0), (2, -2.0), (0, 0.75))),
    (13.0, 1.6, ((2, 4.0), (0, -2.5), (1, 1.0))),
    (14.0, 1.4, ((2, 4.0), (3, -3.0), (2, 1.0), (0, 0.0))),
)
"""Side of the hall (m), distance between walls (m) and openings; see `build_nested_squares`."""
NESTED_OPENING_M = 1.0
CORRIDOR_START_CENTER = (1.1, 1.0)
"""Center of the disc in a corner in which a team starts, m."""
CORRIDOR_START_RADIUS_M = 0.65
CORRIDOR_TEAM_SIZE = 6
CORRIDOR_DURATION_S = 120.0

TEAM_SIZES = (1, 2, 3, 6, 8, 9, 12, 20, 50, 100, 200)
MAX_CORNER_TEAM = 50
"""Largest of these teams that fits into the corner where it starts."""
ROOM_SEEDS = range(901, 905)

LIMITED_RANGES: tuple[dict[str, float], ...] = (
    {},
    {"communication_range": SHORT_RANGE_M},
    {"communication_range": 6.0},
    {"sensing_range": 6.0},
)
LARGE_GAP = 0.05

STAKES = (0.004, 0.016, 0.03, 0.06, 1.0)
"""Values of the gain `stake`. With the last one, robots do not look for viewpoints."""
STAKE_MAP_SEEDS = (331, 332, 333)
"""Seeds of the maps of each kind. The benchmark has other ones."""

REST_TIME_S = 600.0
RESPONSE_TIME_S = 60.0
PACE_DURATION_S = 20.0
FIRST_VERSION_STEP_MS = {6: 0.168, 50: 0.263, 200: 0.575}
"""Time of a step of RAPF before its kernels were compiled, by team size."""
STEPS_PER_S = 60

Event: TypeAlias = Literal["nothing happens", "a robot fails", "a door opens"]
EVENTS: tuple[Event, ...] = ("nothing happens", "a robot fails", "a door opens")


class FinalState(NamedTuple):
    """State of a team in the end."""

    mean_distance: float
    """m"""
    mean_path_length: float
    """m"""


class LimitedRun(NamedTuple):
    """Result of a run."""

    gap: float
    settling_time: float
    """s, nan if the team does not come to rest."""
    mean_path_length: float
    """m"""


class HardCase(NamedTuple):
    """A run on a map that is difficult for planners."""

    map_name: str
    """Argument of `build_hard_map`."""
    robots: int
    duration: float
    """s"""
    start: str | None = None
    """Name of the start; by default, the first of the map."""
    start_seed: int = 0
    has_rival: bool = False
    """Whether `RIVAL_CONTROLLER` runs from the same positions."""


class HardRun(NamedTuple):
    """Result of a run on one of the hard maps."""

    start_cost: float
    """Mean distance at the start, m"""
    end_cost: float
    """Mean distance at the end, m"""
    settling_time: float | None
    """s"""
    mean_path_length: float
    """m"""


HARD_CASES = (
    *(HardCase(f"rooms-{seed}", robots=3, duration=60.0, has_rival=True) for seed in ROOM_SEEDS),
    HardCase("house with a notch", robots=6, duration=120.0),
    HardCase("grid of rooms", robots=6, duration=120.0),
    HardCase("tunnels-7001", robots=6, duration=200.0, start="uniform", start_seed=1),
    HardCase("tunnels-7002", robots=8, duration=200.0, start="uniform", start_seed=1),
)
"""In the tunnels, robots start anywhere, rather than together at the entrance as in the benchmark."""


def build_wall(
    direction: float, door_offset: float, door_width: float, side: float = SQUARE_SIDE_M
) -> tuple[WallObstacle, WallObstacle]:
    """Build the two halves of a wall with a door, through the center of the square.

    Parameters
    ----------
    direction : float, rad
        Direction of the wall's normal vector, from +x.
    door_offset : float, m
        Position of the door along the wall, from the center of the square.
    door_width : float, m
    side : float, m
        Side of the square.

    Returns
    -------
    tuple of two WallObstacle
    """
    along = np.array([-math.sin(direction), math.cos(direction)])
    center = 0.5 * side
    half_length = 0.75 * side
    half_width = 0.5 * door_width
    ends = [-half_length, door_offset - half_width, door_offset + half_width, half_length]
    points = [(float(x), float(y)) for x, y in center + np.outer(ends, along)]
    first_half = WallObstacle((points[0], points[1]), WALL_WIDTH_M)
    second_half = WallObstacle((points[2], points[3]), WALL_WIDTH_M)
    return first_half, second_half


def build_divided_square(
    name: str, wall: tuple[WallObstacle, WallObstacle], side: float = SQUARE_SIDE_M
) -> Environment:
    """Build a square with a wall through its center."""
    return Environment(name, ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side)), wall)


def crosses_random_door(controller: str, seed: int) -> bool:
    """Return whether one of three robots passes through a random door in time."""
    rng = np.random.default_rng(seed)
    door_width = 2.0 * ROBOT_RADIUS_M * rng.uniform(*DOOR_WIDTH_RANGE)
    direction = rng.uniform(0.0, math.tau)
    door_offset = rng.uniform(-MAX_DOOR_OFFSET_M, MAX_DOOR_OFFSET_M)
    wall = build_wall(direction, door_offset, door_width, SQUARE_SIDE_M)
    return crosses_wall(controller, wall, direction, SQUARE_SIDE_M, MAX_CROSSING_TIME_S)


def crosses_wall(
    controller: str, wall: tuple[WallObstacle, WallObstacle], direction: float, side: float, max_time: float
) -> bool:
    """Return whether one of three robots gets to the other side of a wall with a door in time.

    Parameters
    ----------
    controller : str
    wall : tuple of two WallObstacle
        The two halves of the wall.
    direction : float, rad
        Direction of the wall's normal vector, from +x. The robots start 2 m away, opposite to it.
    side : float, m
        Side of the square.
    max_time : float, s

    Returns
    -------
    bool
    """
    environment = build_divided_square("door", wall, side)
    normal = np.array([math.cos(direction), math.sin(direction)])
    center = 0.5 * side
    starts = center - 2.0 * normal + np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    simulation = Simulation(environment, make_controller(controller), starts)
    while simulation.time < max_time:
        simulation.step()
        if ((simulation.positions - center) @ normal).max() >= CROSSED_DISTANCE_M:
            return True
    return False


def measure_doors(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield the number of random doors that robots pass through."""
    is_crossed = np.array(list(pool.map(partial(crosses_random_door, controller), range(count))))
    failed_seeds = np.flatnonzero(~is_crossed)
    low, high = DOOR_WIDTH_RANGE
    yield f"{is_crossed.sum()} of {count} doors of {low:g} to {high:g} diameters crossed; not {failed_seeds}"


def crosses_door_on_large_map(controller: str, case: tuple[float, float, int]) -> bool:
    """Return whether a robot passes through a door, for a side of the square, a width and a seed."""
    side, door_width, seed = case
    rng = np.random.default_rng(seed)
    wall = build_wall(0.0, rng.uniform(-MAX_DOOR_OFFSET_M, MAX_DOOR_OFFSET_M), door_width, side)
    return crosses_wall(controller, wall, 0.0, side, MAX_LARGE_MAP_TIME_S)


def measure_large_maps(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield the number of doors that robots pass through, by the side of the square and the doors' width."""
    for side in SIDES_M:
        cases = [(side, width, seed) for width in DOOR_WIDTHS_M for seed in range(DOORS_PER_WIDTH)]
        is_crossed = list(pool.map(partial(crosses_door_on_large_map, controller), cases))
        crossed_counts = np.reshape(is_crossed, (len(DOOR_WIDTHS_M), DOORS_PER_WIDTH)).sum(axis=1)
        counts = ", ".join(map(str, crossed_counts.tolist()))
        widths = ", ".join(f"{width:g}" for width in DOOR_WIDTHS_M)
        yield f"{side:g} m: {counts} of {DOORS_PER_WIDTH} doors of {widths} m crossed"


def build_hard_map(name: str) -> Environment:
    """Build a map of `HARD_CASES`."""
    if name == "grid of rooms":
        return build_grid_of_rooms()
    if name == "house with a notch":
        return build_house_with_notch()
    kind, _, seed = name.rpartition("-")
    if kind == "rooms":
        return generate_map(int(seed), kind=kind)
    return suite.load_suite_map(name)


def build_grid_of_rooms() -> Environment:
    """Build a square of equal rooms. Each has a narrow door to each of its neighbors."""
    rng = np.random.default_rng(GRID_SEED)
    room_side = GRID_SIDE_M / GRID_ROOMS
    walls = []
    for line in range(1, GRID_ROOMS):
        position = line * room_side
        for room in range(GRID_ROOMS):
            start = room * room_side
            end = start + room_side
            for is_upright in (True, False):
                offset = rng.uniform(-MAX_GRID_DOOR_OFFSET_M, MAX_GRID_DOOR_OFFSET_M)
                door = (start + end) / 2.0 + offset
                half_width = GRID_DOOR_WIDTH_M / 2.0
                walls.append(build_straight_wall(position, start, door - half_width, is_upright=is_upright))
                walls.append(build_straight_wall(position, door + half_width, end, is_upright=is_upright))
    corners = ((0.0, 0.0), (GRID_SIDE_M, 0.0), (GRID_SIDE_M, GRID_SIDE_M), (0.0, GRID_SIDE_M))
    starts = {"corner room": DiscStart((room_side / 2.0, room_side / 2.0), radius=1.0)}
    return Environment("grid of rooms", corners, tuple(walls), starts)


def build_house_with_notch() -> Environment:
    """Build a U-shaped house of five rooms, whose convex hull contains the solid notch of the U."""
    boundary = (
        (0.0, 0.0),
        (16.0, 0.0),
        (16.0, 12.0),
        (11.0, 12.0),
        (11.0, 5.0),
        (5.0, 5.0),
        (5.0, 12.0),
        (0.0, 12.0),
    )
    walls = (
        # Walls across both wings, with doors of 0.9 m.
        build_straight_wall(5.0, 0.0, 2.0, is_upright=False),
        build_straight_wall(5.0, 2.9, 5.0, is_upright=False),
        build_straight_wall(5.0, 11.0, 13.1, is_upright=False),
        build_straight_wall(5.0, 14.0, 16.0, is_upright=False),
        # Walls between the three rooms at the bottom, with doors of 0.9 m.
        build_straight_wall(5.0, 0.0, 1.0, is_upright=True),
        build_straight_wall(5.0, 1.9, 5.0, is_upright=True),
        build_straight_wall(11.0, 0.0, 3.1, is_upright=True),
        build_straight_wall(11.0, 4.0, 5.0, is_upright=True),
    )
    starts = {"left wing": DiscStart((2.5, 9.0), radius=1.0)}
    return Environment("house with a notch", boundary, walls, starts)


def build_square_spiral(side: float, spacing: float, arms: int) -> Environment:
    """Build a square hall in which spiral walls leave one or more corridors to the center.

    Parameters
    ----------
    side : float, m
        Side of the hall.
    spacing : float, m
        Distance between neighboring walls.
    arms : int
        Number of walls, each starting in a different corner of the hall: 1, 2 or 4.
    """
    walls = []
    for arm in range(arms):
        points = []
        for corner in itertools.count():
            half_side = side / 2.0 - arms * spacing * corner / 4.0
            if half_side < MIN_SPIRAL_HALF_SIDE_M:
                break
            x, y = SQUARE_CORNERS[(corner + 4 * arm // arms) % 4]
            points.append((side / 2.0 + x * half_side, side / 2.0 + y * half_side))
        walls.append(WallObstacle(tuple(points), CORRIDOR_WALL_WIDTH_M))
    return build_corridors(f"spiral of {side:g} m, {format_count(arms, 'arm')}", side, walls)


def build_nested_squares(side: float, spacing: float, openings: Sequence[tuple[int, float]]) -> Environment:
    """Build nested square walls in a square hall, each with one opening.

    Parameters
    ----------
    side : float, m
        Side of the hall.
    spacing : float, m
        Distance between neighboring walls.
    openings : sequence of (int, float)
        For each wall from the outermost one: the side of the square, from 0 for the lower one
        counterclockwise, and the offset of the opening from the middle of that side in counterclockwise
        direction, m.

    Raises
    ------
    ValueError
        If an opening is not between the ends of its side.
    """
    walls = []
    for ring, (opening_side, offset) in enumerate(openings):
        half_side = side / 2.0 - (1 + ring) * spacing
        if abs(offset) + NESTED_OPENING_M / 2.0 >= half_side:
            raise ValueError(f"opening at {offset} m: expected one within a side of {2.0 * half_side} m")
        corners = half_side * np.roll(np.array(SQUARE_CORNERS), -opening_side, axis=0)
        direction = (corners[1] - corners[0]) / (2.0 * half_side)
        middle = 0.5 * (corners[0] + corners[1]) + offset * direction
        half_opening = 0.5 * NESTED_OPENING_M * direction
        points = side / 2.0 + np.array(
            [middle + half_opening, *corners[1:], corners[0], middle - half_opening]
        )
        walls.append(WallObstacle(tuple((x, y) for x, y in points.tolist()), CORRIDOR_WALL_WIDTH_M))
    return build_corridors(f"{len(openings)} nested squares of {side:g} m", side, walls)


def build_corridors(name: str, side: float, walls: Sequence[WallObstacle]) -> Environment:
    """Build a square hall with walls, in which a team starts in a corner."""
    starts = {"corner": DiscStart(CORRIDOR_START_CENTER, CORRIDOR_START_RADIUS_M)}
    boundary = ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side))
    return Environment(name, boundary, tuple(walls), starts)


def build_straight_wall(position: float, start: float, end: float, *, is_upright: bool) -> WallObstacle:
    """Build a wall from `start` to `end`, m, at x = `position` if it is upright, else at y = `position`."""
    if is_upright:
        points = ((position, start), (position, end))
    else:
        points = ((start, position), (end, position))
    return WallObstacle(points, WALL_WIDTH_M)


def run_hard_case(controller: str, case: HardCase) -> HardRun:
    """Run a team on one of the hard maps."""
    environment = build_hard_map(case.map_name)
    starts = environment.start(case.start).sample(case.robots, seed=case.start_seed, radius=ROBOT_RADIUS_M)
    record = Simulation(environment, make_controller(controller), starts).run(case.duration)
    cost = CoverageCost(environment, HARD_MAP_LATTICE)
    return HardRun(
        start_cost=cost(starts).mean_distance,
        end_cost=cost(record.positions[-1]).mean_distance,
        settling_time=find_settling_time(record.time, record.positions),
        mean_path_length=float(compute_path_lengths(record.positions).mean()),
    )


def compute_best_cost(case: HardCase) -> float:
    """Return the mean distance of the best known placement on one of the hard maps, m."""
    environment = build_hard_map(case.map_name)
    optimum = find_optimum(
        environment,
        case.robots,
        radius=ROBOT_RADIUS_M,
        lattice=HARD_MAP_LATTICE,
        restarts=REFERENCE_RESTARTS,
    )
    return optimum.mean_distance


def measure_hard_case(controller: str, case: HardCase) -> str:
    """Return the line of one case, with the same columns for each."""
    run = run_hard_case(controller, case)
    best_cost = compute_best_cost(case)
    rest = "not settled"
    if run.settling_time is not None:
        rest = f"settled after {run.settling_time:.0f} s"
    line = (
        f"{case.map_name}, {case.robots} robots, {case.duration:g} s: "
        f"{run.start_cost:.3f} m at the start, {run.end_cost:.3f} m at the end, "
        f"best known {best_cost:.3f} m, gap {run.end_cost / best_cost - 1.0:.1%}; "
        f"{rest}; path length {run.mean_path_length:.1f} m"
    )
    if case.has_rival:
        rival_run = run_hard_case(RIVAL_CONTROLLER, case)
        rival_gap = rival_run.end_cost / best_cost - 1.0
        line += f"; {RIVAL_CONTROLLER}: gap {rival_gap:.1%}, path length {rival_run.mean_path_length:.1f} m"
    return line


def measure_hard_maps(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield costs, rest and path length of each case."""
    yield from pool.map(partial(measure_hard_case, controller), HARD_CASES)


def find_best_cost_in_corridors(environment: Environment) -> float:
    """Return the cost of the best placement in spiral corridors or between nested walls, m."""
    optimum = find_optimum(
        environment,
        CORRIDOR_TEAM_SIZE,
        radius=ROBOT_RADIUS_M,
        lattice=HARD_MAP_LATTICE,
        restarts=REFERENCE_RESTARTS,
    )
    return optimum.mean_distance


def run_in_corridors(
    controller: str, environment: Environment, best_cost: float, communication_range: float
) -> LimitedRun:
    """Run a team in spiral corridors or between nested walls."""
    starts = environment.start(None).sample(CORRIDOR_TEAM_SIZE, seed=0, radius=ROBOT_RADIUS_M)
    team = Team.homogeneous(CORRIDOR_TEAM_SIZE, communication_range=communication_range)
    record = Simulation(environment, make_controller(controller), starts, team).run(CORRIDOR_DURATION_S)
    cost = CoverageCost(environment, HARD_MAP_LATTICE, radius=ROBOT_RADIUS_M)
    settling_time = find_settling_time(record.time, record.positions)
    return LimitedRun(
        gap=cost(record.positions[-1]).mean_distance / best_cost - 1.0,
        settling_time=math.nan if settling_time is None else settling_time,
        mean_path_length=float(compute_path_lengths(record.positions).mean()),
    )


def measure_corridors(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield gaps, rest and path lengths on each map, and their medians for each kind of map."""
    kinds = {
        "spirals": [build_square_spiral(*case) for case in SPIRAL_CASES],
        "nested squares": [build_nested_squares(*case) for case in NESTED_CASES],
    }
    best_costs = {
        kind: list(pool.map(find_best_cost_in_corridors, environments))
        for kind, environments in kinds.items()
    }
    for communication_range in (math.inf, SHORT_RANGE_M):
        conditions = f"communication range {communication_range:g} m"
        if math.isinf(communication_range):
            conditions = "unlimited communication"
        for kind, environments in kinds.items():
            run = partial(run_in_corridors, controller, communication_range=communication_range)
            runs = list(pool.map(run, environments, best_costs[kind]))
            for environment, result in zip(environments, runs, strict=True):
                rest = "not settled"
                if not math.isnan(result.settling_time):
                    rest = f"settled after {result.settling_time:.0f} s"
                yield (
                    f"{environment.name}, {conditions}: gap {result.gap:.1%}; {rest}; "
                    f"path length {result.mean_path_length:.1f} m"
                )
            settled_count = sum(not math.isnan(result.settling_time) for result in runs)
            yield (
                f"{kind}, {conditions}: median gap {np.median([result.gap for result in runs]):.1%}, "
                f"{settled_count} of {len(runs)} settled, "
                f"median path length {np.median([result.mean_path_length for result in runs]):.1f} m"
            )


def run_in_rooms(controller: str, seed: int, communication_range: float, robots: int) -> FinalState:
    """Run a team in generated rooms for 60 s."""
    rooms = generate_map(seed, kind="rooms")
    team = Team.homogeneous(robots, communication_range=communication_range)
    starts = rooms.start(None).sample(robots, seed=0, radius=ROBOT_RADIUS_M)
    record = Simulation(rooms, make_controller(controller), starts, team).run(60.0)
    cost = CoverageCost(rooms, lattice=64)(record.positions[-1])
    path_lengths = compute_path_lengths(record.positions)
    return FinalState(mean_distance=cost.mean_distance, mean_path_length=float(path_lengths.mean()))


def measure_sizes(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield mean distances by team size, and by how much one exceeds that of a smaller team."""
    sizes = [size for size in TEAM_SIZES if size <= MAX_CORNER_TEAM]
    for communication_range in (math.inf, SHORT_RANGE_M):
        for seed in ROOM_SEEDS:
            run = partial(run_in_rooms, controller, seed, communication_range)
            states = list(pool.map(run, sizes))
            costs = np.array([state.mean_distance for state in states])
            increases = costs / np.minimum.accumulate(costs) - 1.0
            table = ", ".join(f"{size}: {cost:.2f}" for size, cost in zip(sizes, costs, strict=True))
            yield (
                f"rooms {seed}, communication range {communication_range} m: {table} m; "
                f"largest increase {increases.max():.1%}; "
                f"path of a single robot {states[0].mean_path_length:.1f} m"
            )


def run_with_ranges(controller: str, map_name: str, ranges: Mapping[str, float]) -> LimitedRun:
    """Run six robots on a map of the suite for 120 s."""
    environment = suite.load_suite_map(map_name)
    team = Team.homogeneous(suite.TEAM_SIZE, **ranges)
    starts = environment.start(None).sample(suite.TEAM_SIZE, seed=0, radius=suite.ROBOT_RADIUS_M)
    record = Simulation(environment, make_controller(controller), starts, team).run(120.0)
    cost = CoverageCost(environment, suite.LATTICE)(record.positions[-1])
    reference = find_reference(map_name, suite.TEAM_SIZE)["mean_distance_m"]
    settling_time = find_settling_time(record.time, record.positions)
    return LimitedRun(
        gap=cost.mean_distance / reference - 1.0,
        settling_time=math.nan if settling_time is None else settling_time,
        mean_path_length=float(compute_path_lengths(record.positions).mean()),
    )


def measure_ranges(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield gaps, rest and path lengths on the maps of the short-range track, next to `rapf`."""
    maps = suite.TRACKS["short-range"].maps
    for ranges in LIMITED_RANGES:
        runs = list(pool.map(partial(run_with_ranges, controller, ranges=ranges), maps))
        reference_runs = list(pool.map(partial(run_with_ranges, REFERENCE_CONTROLLER, ranges=ranges), maps))
        gaps = np.array([run.gap for run in runs])
        reference_gaps = np.array([run.gap for run in reference_runs])
        is_settled = np.isfinite([run.settling_time for run in runs])
        path_length = np.median([run.mean_path_length for run in runs])
        reference_path_length = np.median([run.mean_path_length for run in reference_runs])
        worse_maps = [name for name, is_worse in zip(maps, gaps > reference_gaps, strict=True) if is_worse]
        yield (
            f"{ranges or 'usual ranges'}: median gap {np.median(gaps):.1%}, largest {gaps.max():.0%}, "
            f"{(gaps > LARGE_GAP).sum()} of {len(maps)} above {LARGE_GAP:.0%}; "
            f"{is_settled.mean():.0%} settled after 120 s; path length {path_length:.1f} m; "
            f"{REFERENCE_CONTROLLER}: gap {np.median(reference_gaps):.1%}, "
            f"path length {reference_path_length:.1f} m; worse than it on {worse_maps}"
        )


def run_with_stake(controller: str, stake: float, map_case: tuple[str, int]) -> FinalState:
    """Run six robots for 60 s on a new map of a kind, given with its seed."""
    kind, seed = map_case
    environment = suite.build_family_map(kind, seed)
    starts = environment.start(None).sample(suite.TEAM_SIZE, seed=0, radius=suite.ROBOT_RADIUS_M)
    simulation = Simulation(environment, make_controller(controller, {"stake": stake}), starts)
    record = simulation.run(60.0)
    cost = CoverageCost(environment, lattice=96)(record.positions[-1])
    path_lengths = compute_path_lengths(record.positions)
    return FinalState(mean_distance=cost.mean_distance, mean_path_length=float(path_lengths.mean()))


def measure_stakes(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield costs relative to those with the smallest stake, and path lengths."""
    kinds = [*suite.GENERATORS, *suite.FLOOR_PLANS]
    map_cases = [(kind, seed) for kind in kinds for seed in STAKE_MAP_SEEDS]
    first_distances: FloatArray | None = None
    for stake in STAKES:
        states = list(pool.map(partial(run_with_stake, controller, stake), map_cases))
        mean_distances = np.array([state.mean_distance for state in states])
        path_length = np.mean([state.mean_path_length for state in states])
        if first_distances is None:
            first_distances = mean_distances
        changes = mean_distances / first_distances - 1.0
        yield (
            f"stake {stake:g} on {len(map_cases)} maps: cost {changes.mean():+.1%} (mean), "
            f"{np.median(changes):+.1%} (median), {changes.max():+.1%} (worst); "
            f"path length {path_length:.1f} m"
        )


def measure_response(controller: str, event: Event) -> float:
    """Return how far a team that has rested for ten minutes moves after an event, as a mean, m."""
    environment = load_map("rooms")
    starts = environment.start(None).sample(6, seed=0, radius=ROBOT_RADIUS_M)
    conditions = None
    if event == "a robot fails":
        conditions = Conditions(failures=(Failure(2, REST_TIME_S),))
    elif event == "a door opens":
        environment = build_divided_square("shut", build_wall(0.0, 0.0, 0.0))
        starts = np.array([[x, y] for x in (1.0, 1.5) for y in (1.0, 1.5, 2.0)])
    simulation = Simulation(environment, make_controller(controller), starts, conditions=conditions)
    simulation.run(REST_TIME_S)
    rest_positions = simulation.positions
    if event == "a door opens":
        opened = replace(environment, name="open", obstacles=build_wall(0.0, 0.0, 1.0))
        simulation = simulation.with_changes(environment=opened)
    simulation.run(RESPONSE_TIME_S)
    return float(np.hypot(*(simulation.positions - rest_positions).T).mean())


def measure_rest(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield how far a team at rest moves after each event."""
    distances = pool.map(partial(measure_response, controller), EVENTS)
    for event, distance in zip(EVENTS, distances, strict=True):
        yield f"after 10 min of rest, {event}: robots move by {distance:.2f} m within 1 min"


def time_simulation(controller: str, environment: Environment, starts: FloatArray) -> float:
    """Return the computing time of a simulated second, s."""
    simulation = Simulation(environment, make_controller(controller), starts)
    # The first step compiles kernels.
    simulation.step()
    start_time = time.perf_counter()
    while simulation.time < PACE_DURATION_S:
        simulation.step()
    return (time.perf_counter() - start_time) / PACE_DURATION_S


def measure_pace(controller: str, count: int, pool: ProcessPoolExecutor) -> Iterator[str]:
    """Yield computing times by team size, on maps with the same area for each robot."""
    for size in TEAM_SIZES:
        side = 10.0 * max(1.0, math.sqrt(size / 6.0))
        environment = generate_map(7, kind="polygons", side=side, obstacles=max(6, size))
        starts = environment.start("uniform").sample(size, seed=0, radius=ROBOT_RADIUS_M)
        seconds = time_simulation(controller, environment, starts)
        reference_seconds = time_simulation(REFERENCE_CONTROLLER, environment, starts)
        line = (
            f"{size} robots: {seconds:.3f} s per simulated second, "
            f"{seconds / reference_seconds:.0f} times {REFERENCE_CONTROLLER}"
        )
        if size in FIRST_VERSION_STEP_MS:
            first_version_seconds = STEPS_PER_S * FIRST_VERSION_STEP_MS[size] / 1000.0
            line += f", {seconds / first_version_seconds:.1f} times its first version in numpy"
        yield line


Measure: TypeAlias = Callable[[str, int, ProcessPoolExecutor], Iterator[str]]
MEASURES: Mapping[str, Measure] = {
    "doors": measure_doors,
    "large-maps": measure_large_maps,
    "hard-maps": measure_hard_maps,
    "corridors": measure_corridors,
    "sizes": measure_sizes,
    "ranges": measure_ranges,
    "stakes": measure_stakes,
    "rest": measure_rest,
    "pace": measure_pace,
}


def main() -> None:
    """Print the measures that are named on the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("measures", nargs="+", choices=MEASURES)
    parser.add_argument("--controller", default="atlas")
    parser.add_argument("--count", type=int, default=200, help="number of doors")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    arguments = parser.parse_args()
    with ProcessPoolExecutor(arguments.workers) as pool:
        for name in arguments.measures:
            for line in MEASURES[name](arguments.controller, arguments.count, pool):
                print(f"{arguments.controller}, {name}: {line}", flush=True)


if __name__ == "__main__":
    main()
