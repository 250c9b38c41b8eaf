"""`robocov compare`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import ParameterError
from robocov_app.runs.options import RunOptions
from robocov_app.terminal.arguments import parsed_gains
from robocov_app.terminal.interruption import INTERRUPTED

if TYPE_CHECKING:
    from robocov_app.runs.run import Run


@dataclass
class Arguments(RunOptions):
    """Several controllers from the same starts, under the same limits.

    The folder holds a run's folder for each controller, trajectories and cost curves side by side
    as PNG and SVG, comparison.csv and comparison.json, and on request frames and a film.
    --set k_rep=1 goes to every controller with such a gain, --set rapf.k_rep=1 to one.

    Example: robocov compare office --controllers rapf rpf lloyd --video --out office
    """

    controllers: tuple[str, ...] = ("rapf", "rpf", "lloyd")
    """Controllers by name, or mine.py:MyController."""


def command(options: Arguments) -> int:
    """Run every controller, then draw them together."""
    from robocov.compiled import compile_kernels
    from robocov.files.result_folder import results
    from robocov.mapfile import load_map
    from robocov_app.runs.compare import (
        begin_comparison,
        folder_names,
        gains_for,
        rows_of,
        save_comparison,
    )
    from robocov_app.runs.cost import built_cost
    from robocov_app.runs.film import check_layers, save_moving
    from robocov_app.runs.run import saved_run
    from robocov_app.terminal.interruption import Interruption
    from robocov_app.terminal.output import finite, listed

    names = options.controllers
    if not names:
        raise ParameterError("--controllers: none given, but at least one was wanted")
    if len(set(names)) < len(names):
        raise ParameterError(f"--controllers: {' '.join(names)}: each once was wanted")
    gains = gains_for(names, parsed_gains(options.gains))
    # everything that the user gave is checked before a folder is made
    environment = load_map(options.map)
    specs = [options.spec(environment, name, chosen) for name, chosen in zip(names, gains, strict=True)]
    check_layers(options)
    out = options.out or Path(f"{Path(options.map).stem}-comparison")
    compile_kernels()
    cost = built_cost(environment, options.lattice, quiet=options.json)
    runs: dict[str, Run] = {}
    parts = folder_names(names)
    with (
        results(out, "comparison", overwrite=options.overwrite, parts=parts) as result,
        Interruption() as stop,
    ):
        begin_comparison(result.new, parts)
        for spec, part in zip(specs, parts, strict=True):
            runs[part] = saved_run(spec, cost, result, part, options, stop)
            if stop.requested:
                break
        save_comparison(runs, cost, result.new, options)
        result.keep()
        save_moving(list(runs.values()), cost, result.new, options, stop)
    if options.json:
        print(json.dumps(finite({"out": str(out), "interrupted": stop.requested, "runs": rows_of(runs)})))
    else:
        print_table(runs)
        done = "stopped; what was done is in" if stop.requested else "saved in"
        print(f"{done} {out}/: {listed(out)}{options.record_words}")
    return INTERRUPTED if stop.requested else 0


def print_table(runs: dict[str, Run]) -> None:
    """Print the comparison for people."""
    from robocov_app.render.density import weighed_lines
    from robocov_app.runs.compare import rows_of
    from robocov_app.terminal.tables import BOLD, RIGHT, print_table

    timed = all(run.history.mean_time is not None for run in runs.values())
    titles = ["mean distance", *(["mean time"] if timed else []), "above best"]
    titles += ["cost", "settled", "contacts", "clearance", "path"]
    rows = (
        (
            row["label"],
            f"{row['mean_distance_m']:.3f} m",
            *([f"{row['mean_time_s']:.3f} s"] if timed else []),
            f"{row['above_best']:.1%}",
            f"{row['cost_m3']:.2f} m³",
            "not yet" if row["settled_at_s"] is None else f"{row['settled_at_s']:.1f} s",
            str(row["contacts"]),
            f"{row['min_clearance_m']:.3f} m",
            f"{row['mean_path_length_m']:.2f} m",
        )
        for row in rows_of(runs)
    )
    print_table([("", BOLD), *((title, RIGHT) for title in titles)], rows)
    for line in weighed_lines(next(iter(runs.values())).record.environment):
        print(line)
