"""`robocov compare`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from robocov.errors import ParameterError
from robocov_app.commands.options import RunOptions
from robocov_app.terminal.arguments import parse_gains
from robocov_app.terminal.interruption import INTERRUPTED
from robocov_app.terminal.output import BOLD, RIGHT, list_files, print_answer, print_table


@dataclass
class Arguments(RunOptions):
    """Compare controllers that start from the same positions, under the same limits.

    The folder contains a run folder for each controller, figures of the trajectories and costs side by side
    as PNG and SVG, comparison.csv and comparison.json, and with --frames or --video frames or a video.

    --set k_rep=1 applies to every controller with such a gain, --set rapf.k_rep=1 to one. Controllers in
    files are named by their class, as in --set MyController.k_rep=1.

    Example: robocov compare office --controllers rapf rpf lloyd --out office
    """

    controllers: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ("rapf", "rpf", "lloyd")
    """Names of controllers, or mine.py:MyController."""
    out: Path | None = None
    """Folder for the results (default: MAP-comparison)."""


def command(options: Arguments) -> int:
    """Run `robocov compare`, and return its exit status."""
    from robocov.mapfile import load_map
    from robocov.scenario import format_comparison
    from robocov_app.commands.gain_options import select_gains
    from robocov_app.render.density_text import list_density_lines
    from robocov_app.runs.artifacts import Ending, build_comparison_rows, execute_comparison
    from robocov_app.runs.saved_runs import name_folders

    names = options.controllers
    _check_names(names)
    # Check all input before a folder is created.
    gains = select_gains(names, parse_gains(options.gains))
    environment = load_map(options.map)
    scenarios = {
        folder: options.build_scenario(environment, name, own_gains)
        for folder, name, own_gains in zip(name_folders(names), names, gains, strict=True)
    }
    settings = options.build_output_settings()
    out = options.out or Path(f"{Path(options.map).stem}-comparison")
    runs, ending = execute_comparison(scenarios, out, settings)
    rows = build_comparison_rows(runs)
    if not options.json:
        titles, cells = format_comparison([row["label"] for row in rows], rows)
        print_table([(title, RIGHT if title else BOLD) for title in titles], cells)
    notes = [f"note: {row['label']}: {note}" for row in rows for note in row.get("notes", ())]
    is_interrupted = ending is not Ending.COMPLETE
    message = "saved in"
    if ending is Ending.RUN_INTERRUPTED:
        message = "Interrupted. Partial results are in"
    elif ending is Ending.VIDEO_INTERRUPTED:
        message = options.describe_interrupted_video()
    saved = f"{message} {out}/: {list_files(out)}{options.describe_record()}"
    answer = {"out": str(out), "interrupted": is_interrupted, "runs": rows}
    print_answer(options, answer, *list_density_lines(environment), *notes, saved)
    return INTERRUPTED if is_interrupted else 0


def _check_names(names: Sequence[str]) -> None:
    """Raise a ParameterError if no controllers are given, or if one is given twice."""
    if not names:
        raise ParameterError("--controllers: expected at least one, got none")
    if len(set(names)) < len(names):
        raise ParameterError(
            f"--controllers: {' '.join(names)}: duplicate value. "
            "Compare several gains of a controller in a sweep, or with rc.compare in Python."
        )
