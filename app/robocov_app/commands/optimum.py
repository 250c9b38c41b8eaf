"""`robocov optimum`."""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.errors import InputError, ParameterError, format_count, require_number
from robocov.files.writing import replace_file
from robocov.lower_bound import MIN_PRECISION, LowerBound, compute_lower_bound
from robocov.mapfile import load_map
from robocov.optimum import MAX_RESTARTS, MAX_ROBOTS, find_optimum
from robocov_app.commands.options import FigureOptions
from robocov_app.render.density import density_kind, density_lines, mean_label
from robocov_app.runs.cost import MIN_FIGURE_LATTICE, build_cost, save_distance_figure
from robocov_app.runs.saved_runs import SavedRun, load_saved_runs
from robocov_app.terminal.output import check_output_file, print_answer
from robocov_app.terminal.progress import show_late_progress

_ROBOTS = 6
_WITHIN = 0.001, 0.005, 0.02  # parts of the best within which restarts are counted


@dataclass
class Arguments(FigureOptions):
    """The best positions for a team that knows the whole map: a reference for the coverage cost (22).

    The best of many restarts, each improved on a table of geodesic distances, then by descent of the
    exact cost. How many restarts agree with the best says how far to trust it; --bound proves how much better
    any placement can be. --plot draws a map of the distances.

    Example: robocov optimum rooms --robots 6 --positions best.json --plot best.png
    """

    map: Annotated[tyro.conf.Positional[str | None], tyro.conf.arg(metavar="[MAP]")] = None
    """Path to a map JSON, or the name of a bundled map; not with --run."""
    robots: int | None = None
    """How many; 6 unless said otherwise, with --run as many as there."""
    restarts: int = 24
    """Searches from other seeds, of which the best counts."""
    lattice: int = 128
    """Evaluate on N x N sites over the map."""
    seed: int = 0
    """Another seed, other restarts."""
    radius: float | None = None
    """A robot's, in metres; 0.1 unless said otherwise, with --run as there."""
    run: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """The folder of a run or a comparison: take map and team from there, and print how far it stays above."""
    positions: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Save the positions there, as robocov cost --positions takes them."""
    overwrite: bool = False
    """Replace an earlier file of positions."""
    bound: bool = False
    """Prove a lower bound of the cost of all placements, by the dual; it takes about a minute."""
    precision: float = 0.001
    """With --bound: the part of the cost within which it is enough. Less takes longer."""

    def __post_init__(self) -> None:
        if (self.map is None) == (self.run is None):
            raise InputError("MAP or --run DIR: expected one of the two")
        for name, value in (("--robots", self.robots), ("--radius", self.radius)):
            if self.run is not None and value is not None:
                raise InputError(f"{name}: {value}, but with --run it is that of the run")
        require_number("--robots", _ROBOTS if self.robots is None else self.robots, 1, MAX_ROBOTS, whole=True)
        require_number("--restarts", self.restarts, 1, MAX_RESTARTS, whole=True)
        require_number("--lattice", self.lattice, 2, 2048, whole=True)
        require_number("--precision", self.precision, MIN_PRECISION, 1.0)
        if self.seed < 0:
            raise ParameterError(f"--seed: expected a whole number of at least 0, got {self.seed}")
        if self.positions is not None:
            check_output_file(self.positions, "another name", overwrite=self.overwrite)
        super().__post_init__()


def command(options: Arguments) -> None:
    saved: list[SavedRun] = []
    if options.run is not None:
        saved = load_saved_runs(options.run)
        team = saved[0].record.team
        environment, robots, radius = saved[0].record.environment, len(team), float(team.radius.max())
    else:
        assert options.map is not None
        environment = load_map(options.map)
        robots = _ROBOTS if options.robots is None else options.robots
        radius = DEFAULT_RADIUS_M if options.radius is None else options.radius
    lattice, began = options.lattice, time.perf_counter()
    search: dict[str, Any] = {"lattice": lattice, "restarts": options.restarts, "seed": options.seed}
    with show_late_progress("searching", quiet=options.json) as update:
        best = find_optimum(environment, robots, radius=radius, progress=update, **search)
    seconds = time.perf_counter() - began
    bound: LowerBound | None = None
    if options.bound:
        with show_late_progress("proving the bound", quiet=options.json) as update:
            how: dict[str, Any] = {"lattice": lattice, "precision": options.precision, "progress": update}
            bound = compute_lower_bound(environment, best.positions, radius=radius, **how)
    gaps = []
    if saved:
        lattice_cost = build_cost(environment, lattice, quiet=options.json)
        for each in saved:
            if len(each.record.team) != robots:
                raise InputError(f"{each.folder}: another number of robots than in {saved[0].folder}")
            result = lattice_cost(each.record.positions[-1])
            alike = abs(result.uncovered_area - best.uncovered_area) < 1e-6  # the same components are covered
            gap = best.compute_gap(result.mean_distance) if alike else None
            gaps.append({"run": each.folder.name, "mean_distance_m": result.mean_distance, "gap": gap})
    if options.positions is not None:
        rows = ",\n ".join(json.dumps(place) for place in best.positions.tolist())
        with replace_file(options.positions) as part:
            part.write_text(f"[{rows}]\n", encoding="utf-8")
    if options.plot is not None:
        cost = build_cost(environment, MIN_FIGURE_LATTICE, quiet=True)
        mean = f"{mean_label(environment)} {best.mean_distance:.3f} m"
        title, theme = "Best positions found", options.theme
        save_distance_figure(
            options.plot, cost, best.positions, mean, title=title, theme=theme, radius=radius
        )
    agreement, count = {within: best.compute_agreement(within) for within in _WITHIN}, len(best.costs)
    answer: dict[str, Any] = {"mean_distance_m": best.mean_distance, "cost_m3": best.value}
    answer |= {"uncovered_area_m2": best.uncovered_area, "density": density_kind(environment)}
    answer |= {"robots": robots, "positions_m": best.positions.tolist(), "restarts": count}
    answer |= {"agreement": {f"{within:g}": agreeing for within, agreeing in agreement.items()}}
    answer |= {"restart_mean_distances_m": best.costs.tolist()}
    answer |= {
        "undescended_mean_distances_m": best.costs_before_descent.tolist(),
        "runs": gaps,
        "lower_bound": None,
    }
    lines = [f"mean distance   {best.mean_distance:.4f} m", f"coverage cost   {best.value:.3f} m³"]
    lines += [f"uncovered area  {best.uncovered_area:.3f} m²", *density_lines(environment)]
    if bound is not None:
        proved = {"mean_distance_m": bound.mean_distance, "cost_m3": bound.value, "gap": bound.gap}
        answer["lower_bound"], better = proved, f"no placement is more than {bound.gap:.2%} better"
        lines += [f"lower bound     {bound.mean_distance:.4f} m, {better}"]
    lines += [f"{format_count(robots, 'robot')}, {count} restarts in {seconds:.1f} s, of these"]
    for within, agreeing in agreement.items():
        lines += [f"  within {within:.1%} of the best  {round(agreeing * count):>4}"]
    lines += [f"the median restart ends {best.compute_gap(float(np.median(best.costs))):.2%} above the best"]
    lines += [
        f"descent of the exact cost gained {best.compute_gap(float(best.costs_before_descent.min())):.2%}"
    ]
    for row in gaps:
        above = "other rooms than the best covers"
        above = above if row["gap"] is None else f"{row['gap']:.1%} above the best"
        lines += [f"{row['run']}: mean distance {row['mean_distance_m']:.4f} m, {above}"]
    if options.positions is None:
        lines += ["positions       " + ", ".join(f"[{x:.3f}, {y:.3f}]" for x, y in best.positions.tolist())]
    print_answer(options, answer, *lines)
