"""`robocov compare`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from robocov.errors import ParameterError
from robocov_app.runs.options import RunOptions
from robocov_app.terminal.arguments import parsed_gains
from robocov_app.terminal.interruption import INTERRUPTED
from robocov_app.terminal.output import BOLD, RIGHT, listed, print_table, tell

_COLUMNS = {
    "": "{label}",
    "mean distance": "{mean_distance_m:.3f} m",
    "mean time": "{mean_time_s:.3f} s",
    "above best": "{above_best:.1%}",
    "cost": "{cost_m3:.2f} m³",
    "settled": "{settled}",
    "contacts": "{contacts}",
    "clearance": "{min_clearance_m:.3f} m",
    "path": "{mean_path_length_m:.2f} m",
}


@dataclass
class Arguments(RunOptions):
    """Several controllers from the same starts, under the same limits.

    The folder holds a run's folder for each controller, trajectories and cost curves side by side
    as PNG and SVG, comparison.csv and comparison.json, and on request frames and a film.
    --set k_rep=1 goes to every controller with such a gain, --set rapf.k_rep=1 to one.

    Example: robocov compare office --controllers rapf rpf lloyd --video --out office
    """

    controllers: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ("rapf", "rpf", "lloyd")
    """Controllers by name, or mine.py:MyController."""


def command(options: Arguments) -> int:
    from robocov.mapfile import load_map
    from robocov_app.render.density import density_lines
    from robocov_app.runs.artifacts import gains_for, performed, rows_of
    from robocov_app.runs.saved import folder_names

    names = options.controllers
    if not names:
        raise ParameterError("--controllers: expected at least one, got none")
    if len(set(names)) < len(names):
        raise ParameterError(f"--controllers: {' '.join(names)}: duplicate value")
    gains = gains_for(names, parsed_gains(options.gains))
    # everything that the user gave is checked before a folder is made
    environment = load_map(options.map)
    scenarios = [
        options.build_scenario(environment, name, chosen) for name, chosen in zip(names, gains, strict=True)
    ]
    options.film.layers()
    out = options.out or Path(f"{Path(options.map).stem}-comparison")
    folders = dict(zip(folder_names(names), scenarios, strict=True))
    runs, stopped = performed(folders, out, options, comparison=True)
    rows = rows_of(runs)
    columns = dict(_COLUMNS)
    if not all("mean_time_s" in row for row in rows):
        del columns["mean time"]
    cells = []
    for row in rows:
        settled = "not yet" if row["settled_at_s"] is None else f"{row['settled_at_s']:.1f} s"
        cells.append([text.format(**row, settled=settled) for text in columns.values()])
    if not options.json:
        print_table([(title, RIGHT if title else BOLD) for title in columns], cells)
    notes = [f"note: {row['label']}: {note}" for row in rows for note in row.get("notes", ())]
    done = "stopped; what was done is in" if stopped else "saved in"
    answer = {"out": str(out), "interrupted": stopped, "runs": rows}
    saved = f"{done} {out}/: {listed(out)}{options.record_words}"
    tell(options, answer, *density_lines(environment), *notes, saved)
    return INTERRUPTED if stopped else 0
