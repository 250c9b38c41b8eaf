"""`robocov run`."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from robocov_app.runs.options import RunOptions
from robocov_app.terminal.arguments import parsed_gains
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import echo, listed, tell


@dataclass
class Arguments(RunOptions):
    """Do one run without a window: a team under one controller, everything saved in a folder.

    The folder holds run.json and record.npz (all of the run), cost.csv, trajectories and cost as
    PNG and SVG, and on request frames and a film.

    MAP may also be a session that the window saved, story.robocov: it is done again, touch by touch.

    Example: robocov run rooms --controller rapf --set k_rep=0.3 --robots 8 --video --out eight
    """

    controller: Annotated[str, tyro.conf.arg(metavar="NAME")] = "rapf"
    """A controller by name, or mine.py:MyController; for a session, those it may load: a.py:A,b.py:B."""
    branch: str | None = None
    """Branch of a session to do again, by name or number; by default the one it was saved in."""
    all_branches: bool = False
    """Do all branches of a session, each into a folder of its own."""


def command(options: Arguments) -> int:
    if options.map.endswith(".robocov"):
        return remade(options)
    from robocov.mapfile import load_map
    from robocov_app.render.density import density_lines
    from robocov_app.runs.artifacts import performed
    from robocov_app.runs.saved import folder_names

    # everything that the user gave is checked before a folder is made
    scenario = options.build_scenario(load_map(options.map), options.controller, parsed_gains(options.gains))
    options.film.layers()
    out = options.out or Path(f"{Path(options.map).stem}-{folder_names([options.controller])[0]}")
    runs, stopped = performed({"": scenario}, out, options)
    record, history, summary = runs[""].record, runs[""].history, runs[""].summary
    facts = f"{len(record.team)} robots, {record.time[-1]:.1f} s"
    lines = [f"{record.label} on {record.environment.name}, {facts}"]
    first = f"(at the start {history.mean_distance[0]:.3f} m)"
    lines += [f"  mean distance   {summary['mean_distance_m']:.3f} m   {first}"]
    if history.mean_time is not None:
        first = f"(at the start {history.mean_time[0]:.3f} s)"
        lines += [f"  mean time       {summary['mean_time_s']:.3f} s   {first}"]
    lines += [f"  coverage cost   {summary['cost_m3']:.2f} m³"]
    lines += [f"  {line}" for line in density_lines(record.environment)]
    if summary["uncovered_area_m2"] > 0:
        lines += [f"  uncovered area  {summary['uncovered_area_m2']:.2f} m²   (cut off from every robot)"]
    settled = summary["settled_at_s"]
    lines += [f"  settled         {'not yet' if settled is None else f'after {settled:.1f} s'}"]
    clearance = f"(smallest clearance {summary['min_clearance_m']:.3f} m)"
    lines += [f"  contacts        {summary['contacts']}   {clearance}"]
    path = sum(summary["path_length_m"]) / len(summary["path_length_m"])
    end = f"stopped at {record.time[-1]:.1f} s; what was done is in" if stopped else "saved in"
    lines += [f"  path length     {path:.2f} m per robot"]
    lines += [f"note: {note}" for note in summary.get("notes", ())]
    lines += [f"{end} {out}/: {listed(out)}{options.record_words}"]
    tell(options, {"out": str(out), "interrupted": stopped, **summary}, *lines)
    return INTERRUPTED if stopped else 0


def remade(options: Arguments) -> int:
    answers = []
    with Interruption() as stop:
        for answer in saved_stories(options, stop):
            answers.append(answer)
            if options.json:
                continue
            for row in answer["runs"]:
                told = answer["parts"][row["part"] - 1]
                span = f"{told['from_s']:6.1f} to {told['to_s']:.1f} s"
                echo(f"{span}  {row['controller']}  {row['mean_distance_m']:.3f} m  {told['words']}")
            echo(f"saved in {answer['out']}/: {listed(Path(answer['out']))}")
    tell(options, answers[0] if len(answers) == 1 else {"stories": answers})
    return INTERRUPTED if stop.requested else 0


def saved_stories(options: Arguments, stop: Interruption) -> Iterator[dict[str, Any]]:
    """Make the stories of a session that the options name again, each in its folder; yield what was saved."""
    from robocov.errors import InputError
    from robocov.files.result_folder import create_result
    from robocov.kernel_compilation import compile_kernels
    from robocov_app.viewer.headless import save_story
    from robocov_app.viewer.session.file import load_session, save_session

    path = Path(options.map)
    saved = load_session(path, [name for name in options.controller.split(",") if ":" in name])
    document, stories = saved.document, [(saved.head, saved.step, "")]
    if options.branch is not None:
        branch = document.branch(options.branch)
        stories = [(branch.node, branch.end, "")]
    elif options.all_branches:
        stories = [(each.node, each.end, f"-{k}") for k, each in enumerate(document.branches(), 1)]
    compile_kernels()
    for node, step, suffix in stories:
        out = Path(f"{options.out or path.stem}{suffix}")
        with create_result(out, "story", overwrite=options.overwrite) as result:
            save_session(result.staging / f"session{path.suffix}", document, node, step, saved.view)
            try:
                answer = {"out": str(out), **save_story(document, node, step, result, options, stop)}
            except InputError as error:
                raise InputError(f"{path}: {error}") from None
            result.save_progress()
        yield answer
        if stop.requested:
            return
