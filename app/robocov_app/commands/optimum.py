"""`robocov optimum`."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
import tyro

from robocov.errors import InputError, ParameterError
from robocov.files.atomic import written
from robocov.mapfile import load_map
from robocov.optimum import MOST_RESTARTS, MOST_ROBOTS, Optimum, optimum
from robocov.robots import DEFAULT_RADIUS
from robocov_app.render.density import density_kind, density_lines
from robocov_app.runs.cost import PICTURE_LATTICE, built_cost, draw_distances
from robocov_app.terminal.output import finite, require_fresh
from robocov_app.terminal.progress import late_progress

if TYPE_CHECKING:
    from robocov.environment import Environment
    from robocov_app.runs.saved import Saved

_ROBOTS = 6

_WITHIN = 0.001, 0.005, 0.02  # parts of the best within which restarts are counted


@dataclass
class Arguments:
    """The best positions for a team that knows the whole map: a reference for the coverage cost (22).

    The best of many restarts, each improved on a table of geodesic distances, then by descent of the
    exact cost. How many restarts agree with the best says how far to trust it.

    Example: robocov optimum rooms --robots 6 --positions best.json --plot best.png
    """

    map: Annotated[tyro.conf.Positional[str | None], tyro.conf.arg(metavar="MAP")] = None
    """Path to a map JSON, or the name of a bundled map; not with --run."""
    robots: int | None = None
    """How many; 6 unless said otherwise, with --run as many as there."""
    restarts: int = 24
    """Searches from other seeds, of which the best counts."""
    lattice: int = 64
    """Evaluate on N x N sites over the map."""
    seed: int = 0
    """Another seed, other restarts."""
    radius: float | None = None
    """A robot's, in metres; 0.1 unless said otherwise, with --run as there."""
    run: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """The folder of a run or a comparison: take map and team from there, and tell how far it stays above."""
    positions: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Save the positions there, as robocov cost --positions takes them."""
    plot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Draw a map of the distances to a PNG, SVG or PDF."""
    theme: Literal["light", "dark"] = "light"
    """Colours of the picture."""
    overwrite: bool = False
    """Replace an earlier file of positions."""
    json: bool = False
    """Print one JSON object and nothing else."""


class _Gap(NamedTuple):
    """How far the end of a run is above the best; None where it covers other components."""

    name: str
    mean_distance: float
    gap: float | None


def command(options: Arguments) -> None:
    """Search, save and print."""
    _check(options)
    saved: list[Saved] = []
    if options.run is not None:
        from robocov_app.runs.saved import load_saved

        saved = load_saved(options.run)
        team = saved[0].record.team
        environment, robots, radius = saved[0].record.environment, len(team), float(team.radius.max())
    else:
        assert options.map is not None
        environment = load_map(options.map)
        robots = _ROBOTS if options.robots is None else options.robots
        radius = DEFAULT_RADIUS if options.radius is None else options.radius
    began = time.perf_counter()
    best = _searched(options, environment, robots, radius)
    seconds = time.perf_counter() - began
    gaps = _gaps(options, environment, best, saved)
    if options.positions is not None:
        rows = ",\n ".join(json.dumps(place) for place in best.positions.tolist())
        with written(options.positions) as part:
            part.write_text(f"[{rows}]\n", encoding="utf-8")
    if options.plot is not None:
        from robocov_app.render.density import mean_label

        cost = built_cost(environment, PICTURE_LATTICE, quiet=True)
        mean = f"{mean_label(environment)} {best.mean_distance:.3f} m"
        title, theme = "Best positions found", options.theme
        draw_distances(options.plot, cost, best.positions, mean, title=title, theme=theme, radius=radius)
    if options.json:
        print(json.dumps(finite(_answer(environment, best, gaps))))
    else:
        _print(options, environment, best, gaps, seconds)


def _check(options: Arguments) -> None:
    """Complain about options before anything is computed."""
    if (options.map is None) == (options.run is None):
        raise InputError("MAP or --run DIR: one of the two was wanted")
    for name, value in (("--robots", options.robots), ("--radius", options.radius)):
        if options.run is not None and value is not None:
            raise InputError(f"{name}: {value}, but with --run it is that of the run")
    for name, number, least, most in (
        ("--robots", _ROBOTS if options.robots is None else options.robots, 1, MOST_ROBOTS),
        ("--restarts", options.restarts, 1, MOST_RESTARTS),
        ("--lattice", options.lattice, 2, 2048),
    ):
        if not least <= number <= most:
            raise ParameterError(f"{name}: {number}, but a whole number from {least} to {most} was wanted")
    if options.seed < 0:
        raise ParameterError(f"--seed: {options.seed}, but a whole number of at least 0 was wanted")
    if options.positions is not None:
        require_fresh(options.positions, "another name", overwrite=options.overwrite)
    if options.plot is not None:
        from robocov_app.figures.files import check_figure_path

        check_figure_path(options.plot)


def _searched(options: Arguments, environment: Environment, robots: int, radius: float) -> Optimum:
    """Return the best positions; how far the search is gets told when it takes more than a second."""
    with late_progress("searching", quiet=options.json) as tell:
        return optimum(
            environment,
            robots,
            radius=radius,
            lattice=options.lattice,
            restarts=options.restarts,
            seed=options.seed,
            progress=tell,
        )


def _gaps(options: Arguments, environment: Environment, best: Optimum, saved: list[Saved]) -> list[_Gap]:
    """Return how far the ends of runs are above the best, on the same lattice."""
    if not saved:
        return []
    cost = built_cost(environment, options.lattice, quiet=options.json)
    gaps = []
    for each in saved:
        if len(each.record.team) != len(best.positions):
            raise InputError(f"{each.folder}: another number of robots than in {saved[0].folder}")
        result = cost(each.record.positions[-1])
        alike = abs(result.uncovered_area - best.uncovered_area) < 1e-6
        gap = best.gap(result.mean_distance) if alike else None
        gaps.append(_Gap(each.folder.name, result.mean_distance, gap))
    return gaps


def _answer(environment: Environment, best: Optimum, gaps: list[_Gap]) -> dict[str, Any]:
    return {
        "mean_distance_m": best.mean_distance,
        "cost_m3": best.value,
        "uncovered_area_m2": best.uncovered_area,
        "density": density_kind(environment),
        "robots": len(best.positions),
        "positions_m": best.positions.tolist(),
        "restarts": len(best.costs),
        "agreement": {f"{within:g}": best.agreement(within) for within in _WITHIN},
        "restart_mean_distances_m": best.costs.tolist(),
        "undescended_mean_distances_m": best.undescended.tolist(),
        "runs": [{"run": gap.name, "mean_distance_m": gap.mean_distance, "gap": gap.gap} for gap in gaps],
    }


def _print(
    options: Arguments, environment: Environment, best: Optimum, gaps: list[_Gap], seconds: float
) -> None:
    """Print the answer for people."""
    count, robots = len(best.costs), len(best.positions)
    print(f"mean distance   {best.mean_distance:.4f} m")
    print(f"coverage cost   {best.value:.3f} m³")
    print(f"uncovered area  {best.uncovered_area:.3f} m²")
    for line in density_lines(environment):
        print(line)
    print(f"{robots} robot{'s' if robots > 1 else ''}, {count} restarts in {seconds:.1f} s, of these")
    for within in _WITHIN:
        print(f"  within {within:.1%} of the best  {round(best.agreement(within) * count):>4}")
    print(f"the median restart ends {best.gap(float(np.median(best.costs))):.2%} above the best")
    print(f"descent of the exact cost gained {best.gap(float(best.undescended.min())):.2%}")
    for gap in gaps:
        above = "other rooms than the best covers" if gap.gap is None else f"{gap.gap:.1%} above the best"
        print(f"{gap.name}: mean distance {gap.mean_distance:.4f} m, {above}")
    if options.positions is None:
        print("positions       " + ", ".join(f"[{x:.3f}, {y:.3f}]" for x, y in best.positions.tolist()))
