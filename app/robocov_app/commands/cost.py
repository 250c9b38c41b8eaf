"""`robocov cost`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from robocov.cost import CoverageCost, CoverageResult
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import (
    InputError,
    ParameterError,
    describe_error,
    format_count,
    is_number,
    quote,
    require_number,
)
from robocov.files.writing import replace_file, resolve_target
from robocov.mapfile import load_map
from robocov.typing import FloatArray
from robocov_app.commands.options import FigureOptions
from robocov_app.render.density_text import get_cost_name, get_density_kind, list_density_lines
from robocov_app.runs.cost import build_cost, refine_cost_for_figures, save_distance_figure
from robocov_app.runs.settings import MAX_LATTICE, MIN_LATTICE
from robocov_app.terminal.output import print_answer

_MAX_COORDINATE_M = 1e300
"""Upper limit of absolute coordinates, with which all computations stay finite."""
_MAX_RADIUS_M = 1e3
"""Maximum radius of a robot, as in a team."""


@dataclass
class Arguments(FigureOptions):
    """Compute the exact coverage cost (22) of given positions; --plot draws a map of the distances.

    Example: robocov cost rooms --positions robots.json --lattice 256
    """

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MAP")]
    """Path of a map file, or the name of a bundled map."""
    positions: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """JSON file with a list of [x, y] in meters, one for each robot."""
    speeds: Annotated[tuple[float, ...], tyro.conf.arg(metavar="SPEED ...")] = ()
    """Speed of each robot, or one for all, m/s; sites then belong to the first robot to arrive."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of the smallest robot, m. Space behind narrower gaps counts as uncovered; 0 for points."""
    lattice: int = 128
    """Compute the coverage cost on a lattice of N x N sites over the map."""
    sites: Annotated[Path | None, tyro.conf.arg(metavar="FILE.npz")] = None
    """File for the points, distances and owners of the sites; with --speeds also their times."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("--radius", self.radius, 0.0, _MAX_RADIUS_M, "m")
        require_number("--lattice", self.lattice, MIN_LATTICE, MAX_LATTICE, whole=True)
        if self.sites is not None:
            resolve_target(self.sites)


def command(options: Arguments) -> None:
    """Run `robocov cost`."""
    environment = load_map(options.map)
    positions = _read_positions(options.positions)
    speeds = _build_speeds(options.speeds, len(positions))
    cost = build_cost(environment, options.lattice, radius=options.radius, quiet=options.json)
    try:
        result = cost(positions)
        timed_result = None
        if speeds is not None:
            timed_result = cost(positions, speeds)
    except InputError as error:
        raise InputError(f"{options.positions}: {error}") from error
    if options.sites is not None:
        _save_sites(options.sites, cost, result, timed_result)
    if options.plot is not None:
        text = f"{get_cost_name(environment)} {result.mean_distance:.3f} m"
        if timed_result is not None:
            text = f"mean time {timed_result.mean_time:.3f} s"
        save_distance_figure(
            options.plot,
            refine_cost_for_figures(environment, cost),
            positions,
            text,
            title="Coverage",
            theme=options.theme,
            speeds=speeds,
            radius=options.radius or DEFAULT_RADIUS_M,
        )
    answer = _build_answer(environment, cost, result, timed_result)
    print_answer(options, answer, *_describe_result(environment, cost, result, timed_result))


def _save_sites(
    path: Path, cost: CoverageCost, result: CoverageResult, timed_result: CoverageResult | None
) -> None:
    """Write the distances and owners of the sites to an npz file; with speeds, owners are by travel time."""
    owning_result = timed_result or result
    arrays: dict[str, Any] = {
        "points": cost.points,
        "distances": owning_result.distances,
        "owner": owning_result.owners,
    }
    if timed_result is not None:
        arrays["times"] = timed_result.times
    with replace_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)


def _build_answer(
    environment: Environment, cost: CoverageCost, result: CoverageResult, timed_result: CoverageResult | None
) -> dict[str, Any]:
    """Build the JSON content of the answer."""
    answer: dict[str, Any] = {"mean_distance_m": result.mean_distance}
    if timed_result is not None:
        answer["mean_time_s"] = timed_result.mean_time
        answer["cost_m2_s"] = timed_result.value
    answer["cost_m3"] = result.value
    answer["uncovered_area_m2"] = result.uncovered_area
    answer["robots"] = len(result.positions)
    answer["sites"] = len(cost.points)
    answer["density"] = get_density_kind(environment)
    return answer


def _describe_result(
    environment: Environment, cost: CoverageCost, result: CoverageResult, timed_result: CoverageResult | None
) -> list[str]:
    """Return the costs as lines of text."""
    lines = [f"mean distance   {result.mean_distance:.4f} m"]
    if timed_result is not None:
        lines.append(f"mean time       {timed_result.mean_time:.4f} s")
    lines += [
        f"coverage cost   {result.value:.3f} m³",
        f"uncovered area  {result.uncovered_area:.3f} m²",
        *list_density_lines(environment),
        f"on {len(cost.points)} sites, {format_count(len(result.positions), 'robot')}",
    ]
    return lines


def _build_speeds(values: tuple[float, ...], robots: int) -> FloatArray | None:
    """Return the speed of each robot, (n,) m/s, given one value for all or for each; None without values."""
    if not values:
        return None
    if len(values) not in (1, robots):
        expected = f"expected one, or one for each of {robots} robots"
        raise ParameterError(f"--speeds: {expected}, got {len(values)} numbers")
    for speed in values:
        if not 0.0 < speed < np.inf:
            raise ParameterError(f"--speeds: expected a number above 0, got {speed!r} m/s")
    if len(values) == 1:
        return np.full(robots, values[0])
    return np.array(values)


def _read_positions(path: Path) -> FloatArray:
    """Read positions, (n, 2) m, from a JSON file; raise InputError for the first invalid position."""
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {describe_error(error)}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}") from error
    if not isinstance(content, list) or not content:
        raise InputError(f"{path}: expected a list of [x, y] in meters, got {quote(content)}")
    for index, pair in enumerate(content):
        if not _is_point(pair):
            expected = "expected [x, y], two finite numbers in meters"
            raise InputError(f"{path}: [{index}]: {expected}, got {quote(pair)}")
    return np.array(content, dtype=float)


def _is_point(value: Any) -> bool:
    """Return whether a value is a list of two numbers below the limit of coordinates."""
    if not isinstance(value, list) or len(value) != 2:
        return False
    return all(is_number(coordinate) and abs(coordinate) < _MAX_COORDINATE_M for coordinate in value)
