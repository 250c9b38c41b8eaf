"""`robocov optimum`."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from robocov.defaults import DEFAULT_RADIUS_M, DEFAULT_ROBOTS
from robocov.environment import Environment
from robocov.errors import InputError, format_count, require_number, require_whole_number
from robocov.files.writing import replace_file
from robocov.lower_bound import MIN_PRECISION, LowerBound, compute_lower_bound
from robocov.mapfile import load_map
from robocov.optimum import MAX_RESTARTS, MAX_ROBOTS, Optimum, find_optimum
from robocov.typing import FloatArray
from robocov_app.commands.options import FigureOptions
from robocov_app.render.density_text import get_cost_name, get_density_kind, list_density_lines
from robocov_app.runs.cost import AREA_TOLERANCE_M2, MIN_FIGURE_LATTICE, build_cost, save_distance_figure
from robocov_app.runs.saved_runs import SavedRun, has_constant_setting, load_saved_runs
from robocov_app.runs.settings import MAX_LATTICE, MIN_LATTICE
from robocov_app.terminal.output import check_output_file, print_answer
from robocov_app.terminal.progress import show_late_progress

_AGREEMENT_TOLERANCES = (0.001, 0.005, 0.02)
"""Relative cost differences within which restarts count as agreeing with the best one."""


@dataclass
class Arguments(FigureOptions):
    """Search for the best positions on a known map, as a reference for the coverage cost (22).

    The result is the best of many restarts. Each is improved on a table of geodesic distances, and then by
    descent of the exact cost. The more restarts agree, the more you can trust the result; --bound proves how
    much better any placement can be. --plot draws a map of the distances.

    Example: robocov optimum rooms --robots 6 --positions best.json --plot best.png
    """

    map: Annotated[tyro.conf.Positional[str | None], tyro.conf.arg(metavar="[MAP]")] = None
    """Path of a map file, or the name of a bundled map; not with --run."""
    robots: int | None = None
    """Number of robots (default: 6, or that of the run)."""
    restarts: int = 24
    """Number of restarts, each from its own seed; the best one is used."""
    lattice: int = 128
    """Compute the coverage cost on a lattice of N x N sites over the map."""
    seed: int = 0
    """Seed of the restarts."""
    radius: float | None = None
    """Radius of a robot, m (default: 0.1, or that of the run)."""
    run: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder of a run or a comparison: use its map and team, and print its gap to the best placement."""
    positions: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """File for the positions, in the format of robocov cost --positions."""
    overwrite: bool = False
    """Replace an earlier file of positions."""
    bound: bool = False
    """Also compute a certified lower bound on the cost of all placements; takes about a minute."""
    precision: float = 0.001
    """Relative tolerance of --bound; smaller is slower."""

    def __post_init__(self) -> None:
        """Check that the options are in range and do not contradict each other."""
        if (self.map is None) == (self.run is None):
            raise InputError("expected either MAP or --run DIR")
        if self.run is not None:
            self._check_run_options()
        if self.robots is not None:
            require_number("--robots", self.robots, 1, MAX_ROBOTS, whole=True)
        require_number("--restarts", self.restarts, 1, MAX_RESTARTS, whole=True)
        require_number("--lattice", self.lattice, MIN_LATTICE, MAX_LATTICE, whole=True)
        require_number("--precision", self.precision, MIN_PRECISION, 1.0)
        require_whole_number("--seed", self.seed, 0)
        if self.positions is not None:
            check_output_file(self.positions, "another --positions", overwrite=self.overwrite)
        super().__post_init__()

    def _check_run_options(self) -> None:
        """Raise an InputError if an option is given although the run sets its value."""
        for name, value in (("--robots", self.robots), ("--radius", self.radius)):
            if value is not None:
                raise InputError(f"{name}: cannot be combined with --run, which gives its value; got {value}")


@dataclass
class _Problem:
    """The map and the team for which the best positions are searched."""

    environment: Environment
    robots: int
    """Number of robots."""
    radius: float
    """Radius of a robot, m."""
    saved_runs: list[SavedRun]
    """Runs of this team on this map; empty if the map is given by its name."""


def command(options: Arguments) -> None:
    """Run `robocov optimum`."""
    problem = _build_problem(options)
    start = time.perf_counter()
    best = _search(options, problem)
    seconds = time.perf_counter() - start
    bound = None
    if options.bound:
        bound = _prove_bound(options, problem, best)
    gaps = _compute_run_gaps(options, problem, best)
    if options.positions is not None:
        _save_positions(options.positions, best.positions)
    if options.plot is not None:
        _save_figure(options, options.plot, problem, best)
    answer = _build_answer(problem, best, bound, gaps)
    lines = _describe_best(problem.environment, best, bound)
    lines += _describe_search(best, problem.robots, seconds)
    lines += [_describe_gap(gap) for gap in gaps]
    if options.positions is None:
        positions = ", ".join(f"[{x:.3f}, {y:.3f}]" for x, y in best.positions.tolist())
        lines.append(f"positions       {positions}")
    print_answer(options, answer, *lines)


def _build_problem(options: Arguments) -> _Problem:
    """Load the map and the team, from the options or from the saved runs."""
    if options.run is None:
        assert options.map is not None
        return _Problem(
            environment=load_map(options.map),
            robots=DEFAULT_ROBOTS if options.robots is None else options.robots,
            radius=DEFAULT_RADIUS_M if options.radius is None else options.radius,
            saved_runs=[],
        )
    saved_runs = load_saved_runs(options.run)
    for saved in saved_runs:
        _check_run(saved, saved_runs[0])
    record = saved_runs[0].record
    return _Problem(
        environment=record.environment,
        robots=len(record.team),
        radius=float(record.team.radius.max()),
        saved_runs=saved_runs,
    )


def _check_run(saved: SavedRun, first: SavedRun) -> None:
    """Raise InputError if a run has a changing team or map, or another team size than the first run."""
    record = saved.record
    if not has_constant_setting(record):
        raise InputError(
            f"{saved.folder}: expected a run without moving obstacles, failures or joins, "
            "because these change the best placement"
        )
    robots = len(first.record.team)
    if len(record.team) != robots:
        raise InputError(
            f"{saved.folder}: expected {robots} robots as in {first.folder}, got {len(record.team)}"
        )


def _search(options: Arguments, problem: _Problem) -> Optimum:
    """Search for the best positions, showing the progress if that takes long."""
    with show_late_progress("searching", quiet=options.json) as update:
        return find_optimum(
            problem.environment,
            problem.robots,
            radius=problem.radius,
            lattice=options.lattice,
            restarts=options.restarts,
            seed=options.seed,
            progress=update,
        )


def _prove_bound(options: Arguments, problem: _Problem, best: Optimum) -> LowerBound:
    """Compute a lower bound on the cost of all placements, showing the progress if that takes long."""
    with show_late_progress("proving the bound", quiet=options.json) as update:
        return compute_lower_bound(
            problem.environment,
            best.positions,
            radius=problem.radius,
            lattice=options.lattice,
            precision=options.precision,
            progress=update,
        )


def _compute_run_gaps(options: Arguments, problem: _Problem, best: Optimum) -> list[dict[str, Any]]:
    """Compute the gap of each saved run to the best placement.

    The gap is None if the run covers other components of the free space.
    """
    if not problem.saved_runs:
        return []
    cost = build_cost(problem.environment, options.lattice, radius=problem.radius, quiet=options.json)
    gaps = []
    for saved in problem.saved_runs:
        result = cost(saved.record.positions[-1])
        gap = None
        if abs(result.uncovered_area - best.uncovered_area) < AREA_TOLERANCE_M2:
            gap = best.compute_gap(result.mean_distance)
        gaps.append({"run": saved.folder.name, "mean_distance_m": result.mean_distance, "gap": gap})
    return gaps


def _save_positions(path: Path, positions: FloatArray) -> None:
    """Write positions, (n, 2) m, as JSON with one robot per line."""
    rows = ",\n ".join(json.dumps(position) for position in positions.tolist())
    with replace_file(path) as temporary:
        temporary.write_text(f"[{rows}]\n", encoding="utf-8")


def _save_figure(options: Arguments, path: Path, problem: _Problem, best: Optimum) -> None:
    """Draw the distances to the best positions, on a lattice that is fine enough for a figure."""
    environment = problem.environment
    save_distance_figure(
        path,
        build_cost(environment, MIN_FIGURE_LATTICE, radius=problem.radius, quiet=True),
        best.positions,
        f"{get_cost_name(environment)} {best.mean_distance:.3f} m",
        title="Best positions found",
        theme=options.theme,
        radius=problem.radius,
    )


def _build_answer(
    problem: _Problem, best: Optimum, bound: LowerBound | None, gaps: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """Build the JSON content of the answer."""
    lower_bound = None
    if bound is not None:
        lower_bound = {
            "mean_distance_m": bound.mean_distance,
            "cost_m3": bound.value,
            "max_saving": bound.max_saving,
        }
    return {
        "mean_distance_m": best.mean_distance,
        "cost_m3": best.value,
        "uncovered_area_m2": best.uncovered_area,
        "density": get_density_kind(problem.environment),
        "robots": problem.robots,
        "positions_m": best.positions.tolist(),
        "restarts": len(best.costs),
        "agreement": {
            f"{tolerance:g}": best.compute_agreement(tolerance) for tolerance in _AGREEMENT_TOLERANCES
        },
        "restart_mean_distances_m": best.costs.tolist(),
        "undescended_mean_distances_m": best.costs_before_descent.tolist(),
        "runs": list(gaps),
        "lower_bound": lower_bound,
    }


def _describe_best(environment: Environment, best: Optimum, bound: LowerBound | None) -> list[str]:
    """Return the costs of the best placement as lines of text."""
    lines = [
        f"mean distance   {best.mean_distance:.4f} m",
        f"coverage cost   {best.value:.3f} m³",
        f"uncovered area  {best.uncovered_area:.3f} m²",
        *list_density_lines(environment),
    ]
    if bound is not None:
        lines.append(
            f"lower bound     {bound.mean_distance:.4f} m, "
            f"no placement is more than {bound.max_saving:.2%} better"
        )
    return lines


def _describe_search(best: Optimum, robots: int, seconds: float) -> list[str]:
    """Return the agreement of the restarts, and the gain from descent, as lines of text."""
    restarts = len(best.costs)
    lines = [f"{format_count(robots, 'robot')}, {format_count(restarts, 'restart')} in {seconds:.1f} s"]
    for tolerance in _AGREEMENT_TOLERANCES:
        agreeing = round(best.compute_agreement(tolerance) * restarts)
        lines.append(f"  within {tolerance:.1%} of the best: {agreeing}")
    median_gap = best.compute_gap(float(np.median(best.costs)))
    gain = best.compute_gap(float(best.costs_before_descent.min()))
    lines.append(f"gap of the median restart: {median_gap:.2%}")
    lines.append(f"gap before the descent of the exact cost: {gain:.2%}")
    return lines


def _describe_gap(gap: dict[str, Any]) -> str:
    """Return the gap of a run as a line of text."""
    comparison = "no gap: covers different parts of the map from the best placement"
    if gap["gap"] is not None:
        comparison = f"gap {gap['gap']:.1%}"
    return f"{gap['run']}: mean distance {gap['mean_distance_m']:.4f} m, {comparison}"
