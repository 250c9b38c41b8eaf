"""`robocov run`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import tyro

from robocov.defaults import DEFAULT_CONTROLLER
from robocov.errors import format_count
from robocov_app.commands.options import RunOptions
from robocov_app.terminal.arguments import parse_gains
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import echo, list_files, print_answer

if TYPE_CHECKING:
    from robocov_app.runs.execution import Run
    from robocov_app.viewer.session.document import Node
    from robocov_app.viewer.session.files.session_file import SavedSession

_SESSION_SUFFIX = ".robocov"
"""Suffix of session files."""


@dataclass
class Arguments(RunOptions):
    """Simulate one run without a window, and save everything in a folder.

    The folder contains run.json and record.npz (the whole run), cost.csv, figures of the trajectories and
    the cost as PNG and SVG, and with --frames or --video frames or a video.

    MAP may also be a session that was saved in the window, such as session.robocov: it is simulated again
    with all edits.

    Example: robocov run rooms --robots 8 --set k_rep=0.5 --video --out eight
    """

    controller: Annotated[str, tyro.conf.arg(metavar="NAME")] = DEFAULT_CONTROLLER
    """Name of a controller, or mine.py:MyController.

    For a session, the controllers in files that it may load, as in a.py:A,b.py:B.
    """
    branch: str | None = None
    """Branch of a session, by name or number.

    By default, it is the displayed branch, up to the step at which the session was saved.
    """
    all_branches: bool = False
    """Simulate all branches of a session, each into its own folder."""


def command(options: Arguments) -> int:
    """Run `robocov run`, and return its exit status."""
    if options.map.endswith(_SESSION_SUFFIX):
        return _replay_session(options)
    from robocov.mapfile import load_map
    from robocov_app.runs.artifacts import Ending, execute_run
    from robocov_app.runs.saved_runs import name_folders

    # Check all input before a folder is created.
    scenario = options.build_scenario(load_map(options.map), options.controller, parse_gains(options.gains))
    settings = options.build_output_settings()
    out = options.out
    if out is None:
        out = Path(f"{Path(options.map).stem}-{name_folders([options.controller])[0]}")
    run, ending = execute_run(scenario, out, settings)
    is_interrupted = ending is not Ending.COMPLETE
    message = "saved in"
    if ending is Ending.RUN_INTERRUPTED:
        message = f"Interrupted at {run.record.time[-1]:.1f} s. Partial results are in"
    elif ending is Ending.VIDEO_INTERRUPTED:
        message = options.describe_interrupted_video()
    lines = [*_describe_run(run), f"{message} {out}/: {list_files(out)}{options.describe_record()}"]
    print_answer(options, {"out": str(out), "interrupted": is_interrupted, **run.summary}, *lines)
    return INTERRUPTED if is_interrupted else 0


def _describe_run(run: Run) -> list[str]:
    """Return the results of a run as lines of text."""
    from robocov_app.render.density_text import list_density_lines

    record = run.record
    history = run.history
    summary = run.summary
    path_lengths = summary["path_length_m"]
    settled = "not yet"
    if summary["settled_at_s"] is not None:
        settled = f"after {summary['settled_at_s']:.1f} s"
    robots = format_count(len(record.team), "robot")
    lines = [
        f"{record.label} on {record.environment.name}, {robots}, {record.time[-1]:.1f} s",
        f"  mean distance   {summary['mean_distance_m']:.3f} m   "
        f"(at the start {history.mean_distance[0]:.3f} m)",
    ]
    if history.mean_time is not None:
        lines.append(
            f"  mean time       {summary['mean_time_s']:.3f} s   (at the start {history.mean_time[0]:.3f} s)"
        )
    lines.append(f"  coverage cost   {summary['cost_m3']:.2f} m³")
    lines += [f"  {line}" for line in list_density_lines(record.environment)]
    if summary["uncovered_area_m2"] > 0:
        lines.append(f"  uncovered area  {summary['uncovered_area_m2']:.2f} m²   (cut off from every robot)")
    lines += [
        f"  settled         {settled}",
        f"  contacts        {summary['contacts']}   (smallest clearance {summary['min_clearance_m']:z.3f} m)",
    ]
    if summary["stuck_robots"]:
        lines.append(f"  stuck robots    {summary['stuck_robots']}   (at rest away from their goals)")
    lines.append(f"  path length     {sum(path_lengths) / len(path_lengths):.2f} m per robot")
    if "sent_bytes_per_s" in summary:
        lines.append(f"  messages        {summary['sent_bytes_per_s']:.0f} B/s per robot")
    lines += [f"note: {note}" for note in summary.get("notes", ())]
    return lines


def _replay_session(options: Arguments) -> int:
    """Simulate a session again, print its results, and return the exit status."""
    answers = []
    with Interruption() as interruption:
        for answer in save_branches(options, interruption):
            answers.append(answer)
            if not options.json:
                _print_branch(answer)
    print_answer(options, answers[0] if len(answers) == 1 else {"branches": answers})
    return INTERRUPTED if interruption.requested else 0


def _print_branch(answer: dict[str, Any]) -> None:
    """Print the results of a branch: one line for each part and controller."""
    for row in answer["runs"]:
        part = answer["parts"][row["part"] - 1]
        span = f"{part['from_s']:6.1f} to {part['to_s']:.1f} s"
        echo(f"{span}  {row['controller']}  {row['mean_distance_m']:.3f} m  {part['description']}")
    echo(f"saved in {answer['out']}/: {list_files(Path(answer['out']))}")


def save_branches(options: Arguments, interruption: Interruption) -> Iterator[dict[str, Any]]:
    """Simulate the selected branches of a session, save each in its own folder, and yield their results.

    Raises
    ------
    InputError
        If the session cannot be read, or a branch cannot be simulated.
    """
    from robocov.errors import InputError
    from robocov.files.result_folder import create_result
    from robocov.files.result_names import SESSION_FILE
    from robocov.kernel_compilation import compile_kernels
    from robocov_app.viewer.branch_output.parts import SelectedBranch
    from robocov_app.viewer.branch_output.save import save_branch
    from robocov_app.viewer.session.files.session_file import load_session, save_session

    path = Path(options.map)
    settings = options.build_output_settings()
    session = load_session(path, [name for name in options.controller.split(",") if ":" in name])
    branches = _select_branches(session, options)
    compile_kernels()
    for node, step, suffix in branches:
        out = Path(f"{options.out or path.stem}{suffix}")
        with create_result(out, "branch", overwrite=options.overwrite) as result:
            session_copy = result.staging / SESSION_FILE
            save_session(session_copy, session.document, node, step, session.view)
            try:
                branch = SelectedBranch(session.document, node, step)
                results = save_branch(branch, result, settings, interruption)
            except InputError as error:
                raise InputError(f"{path}: {error}") from None
            result.save_progress()
        yield {"out": str(out), **results}
        if interruption.requested:
            return


class _BranchSelection(NamedTuple):
    """A branch to simulate up to a step, and the suffix of the name of its result folder."""

    node: Node
    last_step: int
    folder_suffix: str


def _select_branches(session: SavedSession, options: Arguments) -> list[_BranchSelection]:
    """Select the branches to simulate.

    By default, this is the branch of the session, up to the step at which it was saved.
    """
    document = session.document
    if options.branch is not None:
        branch = document.find_branch(options.branch)
        return [_BranchSelection(branch.node, branch.last_step, "")]
    if options.all_branches:
        return [
            _BranchSelection(branch.node, branch.last_step, f"-{number}")
            for number, branch in enumerate(document.list_branches(), start=1)
        ]
    return [_BranchSelection(session.head, session.step, "")]
