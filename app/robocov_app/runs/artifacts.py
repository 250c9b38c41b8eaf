"""Artifacts of runs: a folder with numbers, pictures and a film of one, or of several side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.controllers import get_gains, load_controller_class
from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.errors import ParameterError, describe_unknown_name, format_count
from robocov.files.result_folder import ResultKind, create_result
from robocov.kernel_compilation import compile_kernels
from robocov.scenario import Scenario
from robocov_app.runs.cost import built_cost, cost_for_pictures
from robocov_app.runs.options import RunOptions
from robocov_app.runs.run import Run, saved_run
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import finite, write_csv, write_json
from robocov_app.terminal.progress import counting, progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from robocov_app.figures.coverage import Moment
    from robocov_app.figures.curves import Curve

_HEAD = {"format": "robocov-comparison", "version": 1}
_FIGURES = (
    *("mean_distance_m", "cost_m3", "uncovered_area_m2", "settled_at_s", "contacts", "min_clearance_m"),
    "mean_time_s",  # where robots are not equally fast
)


def performed(
    scenarios: Mapping[str, Scenario], out: Path, options: RunOptions, *, comparison: bool = False
) -> tuple[dict[str, Run], bool]:
    """Do one run, or compare several on one map, by their folders' names; also tell if Ctrl-C ended it."""
    compile_kernels()
    cost = built_cost(next(iter(scenarios.values())).environment, options.lattice, quiet=options.json)
    kind: ResultKind = "comparison" if comparison else "run"
    parts, runs = scenarios if comparison else (), dict[str, Run]()
    with create_result(out, kind, overwrite=options.overwrite, parts=parts) as result, Interruption() as stop:
        if comparison:
            begin_comparison(result.staging, list(scenarios))
        for part, scenario in scenarios.items():
            runs[part] = saved_run(scenario, cost, result, part if comparison else "", options, stop)
            if stop.requested:
                break
        if comparison:
            save_comparison(runs, cost, result.staging, options)
        else:
            save_pictures(list(runs.values()), cost, result.staging, options)
        result.save_progress()
        if options.film.video or options.film.frames:
            from robocov_app.runs.film import save_moving

            save_moving(list(runs.values()), cost, result.staging, options.film, stop, quiet=options.json)
    return runs, stop.requested


def gains_for(names: Sequence[str], given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the gains of each controller: ``k_rep`` is for all that have it, ``rapf.k_rep`` for one."""
    known = {name: get_gains(load_controller_class(name)) for name in names}
    chosen: list[dict[str, Any]] = [{} for _ in names]
    # what is said of one controller alone counts for more than what is said of all
    for key, value in sorted(given.items(), key=lambda item: "." in item[0]):
        owner, dot, gain = key.rpartition(".")
        if dot and owner not in known:
            raise ParameterError(f"--set {key}: {describe_unknown_name('controller', owner, known)}")
        takers = [k for k, name in enumerate(names) if gain in known[name] and (not dot or name == owner)]
        if not takers:
            every = known[owner] if dot else {gain for name in names for gain in known[name]}
            raise ParameterError(f"--set {key}: {describe_unknown_name('gain', gain, every)}")
        for k in takers:
            chosen[k][gain] = value
    return chosen


def rows_of(runs: Mapping[str, Run]) -> list[dict[str, Any]]:
    """Return one row for each run: its figures, and the excess of its mean distance over the best."""
    best = min(run.summary["mean_distance_m"] for run in runs.values())
    return [
        {
            "controller": name,
            "label": run.record.label,
            "gains": dict(run.record.gains),
            **{figure: run.summary[figure] for figure in _FIGURES if figure in run.summary},
            "mean_path_length_m": sum(run.summary["path_length_m"]) / len(run.record.team),
            "above_best": run.summary["mean_distance_m"] / best - 1.0,
            **({"notes": run.summary["notes"]} if "notes" in run.summary else {}),
        }
        for name, run in runs.items()
    ]


def begin_comparison(folder: Path, folders: Sequence[str]) -> None:
    write_json(folder / "comparison.json", {**_HEAD, "folders": list(folders), "runs": []})


def save_comparison(runs: Mapping[str, Run], cost: CoverageCost, folder: Path, options: RunOptions) -> None:
    """Write ``comparison.json|csv``, and ``trajectories`` and ``cost`` as PNG and SVG."""
    rows = rows_of(runs)
    content = {**_HEAD, "lattice": options.lattice, "folders": list(runs), "runs": rows}
    write_json(folder / "comparison.json", finite(content))
    columns = [name for name in rows[0] if name not in ("label", "gains", "notes")]
    write_csv(folder / "comparison.csv", ",".join(columns), ([row[name] for name in columns] for row in rows))
    save_pictures(list(runs.values()), cost, folder, options, comparison=True)


def save_pictures(
    runs: Sequence[Run], cost: CoverageCost, folder: Path, options: RunOptions, *, comparison: bool = False
) -> None:
    """Draw ``trajectories.png|svg`` and ``cost.png|svg`` of a run, or of a comparison, if wanted."""
    if options.no_pictures:
        return
    from robocov_app.figures.coverage import plot_coverage
    from robocov_app.figures.files import save_figure
    from robocov_app.figures.runs import plot_comparison, plot_trajectories

    records, times = [run.record for run in runs], [run.final_time for run in runs]
    finals = [float(run.history.mean_distance[-1]) for run in runs]
    film = options.film
    theme, size = film.colour_theme, film.picture_size()

    def curves(kind: str) -> list[Curve]:
        found = []
        for run in runs:
            value = getattr(run.history, kind)
            if value is not None and (kind == "mean_distance" or np.isfinite(value).any()):
                found.append((run.record.label, run.record.controller, run.history.time, value))
        return found

    with progress("pictures", 4, quiet=options.json) as update:
        done = counting(update)

        def save(figure: Figure, stem: str) -> None:
            for suffix in (".png", ".svg"):
                save_figure(figure, folder / (stem + suffix))
                done()

        look = (theme, film.colours, size)
        if comparison:
            save(plot_comparison(records, *look, finals, times), "trajectories")
        else:
            save(plot_trajectories(records[0], None, *look, finals[0], times[0]), "trajectories")
        robots = format_count(len(records[0].team), "robot")
        title = f"Coverage cost  ·  {records[0].environment.name}  ·  {robots}"
        moments, timed = last_moments(runs, cost), curves("mean_time")
        save(plot_coverage(curves("mean_distance"), moments, theme, size, title, timed), "cost")


def last_moments(runs: Sequence[Run], cost: CoverageCost) -> list[Moment]:
    """Return the last moments of runs on one map, but for robots that failed at other places, to be drawn."""
    from robocov_app.figures.coverage import Moment
    from robocov_app.render.distance_field import Field, FieldLattice

    drawn, moments = runs[0].record.environment, []
    cost = cost_for_pictures(drawn, cost)
    for run in runs:
        record = run.record
        if record.environment != drawn:
            drawn = record.environment
            cost = built_cost(drawn, cost.lattice, quiet=True)
        momentary, time = TimeVaryingCost(cost), float(record.time[-1])
        working = momentary.find_counted_robots(time, record.positions[-1], record.working[-1])
        if working.any():
            now, rows = momentary.get_cost(time), np.flatnonzero(working)
            field = Field(FieldLattice(now.sites), now(record.positions[-1][rows]))
            mean = float(run.history.mean_distance[-1])
            moments.append(Moment.last_of(record, field, mean, rows, run.final_time))
    return moments
