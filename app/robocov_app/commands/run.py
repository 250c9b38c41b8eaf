"""`robocov run`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov_app.runs.options import RunOptions
from robocov_app.terminal.arguments import parsed_gains
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import finite, listed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov_app.runs.run import Run


@dataclass
class Arguments(RunOptions):
    """One headless run: a team under one controller, everything saved in a folder.

    The folder holds run.json and record.npz (all of the run), cost.csv, trajectories and cost as
    PNG and SVG, and on request frames and a film.

    For MAP a session of the window may stand, story.robocov: it is made again, touch by touch.

    Example: robocov run rooms --controller rapf --set k_rep=0.3 --robots 8 --video --out eight
    """

    controller: str = "rapf"
    """A controller by name, or mine.py:MyController. Of a session: yours that it may run, as a.py:A,b.py:B"""
    branch: str | None = None
    """Of a session, the story to make again: its name, or its number; by default the one it was saved in."""
    all_branches: bool = False
    """Of a session, all stories, each in a folder of its own."""


def command(options: Arguments) -> int:
    """Simulate, evaluate, save and draw."""
    if options.map.endswith(".robocov"):
        return remade(options)
    from robocov.mapfile import load_map
    from robocov_app.runs.artifacts import performed
    from robocov_app.runs.saved import folder_names

    # everything that the user gave is checked before a folder is made
    spec = options.spec(load_map(options.map), options.controller, parsed_gains(options.gains))
    options.film.layers()
    out = options.out or Path(f"{Path(options.map).stem}-{folder_names([options.controller])[0]}")
    runs, stopped = performed({"": spec}, out, options)
    run = runs[""]
    if options.json:
        print(json.dumps(finite({"out": str(out), "interrupted": stopped, **run.summary})))
    else:
        print_summary(run)
        end = f"stopped at {run.record.time[-1]:.1f} s; what was done is in"
        print(f"{end if stopped else 'saved in'} {out}/: {listed(out)}{options.record_words}")
    return INTERRUPTED if stopped else 0


def remade(options: Arguments) -> int:
    """Make stories of a session again, and save them."""
    answers = []
    with Interruption() as stop:
        for answer in saved_stories(options, stop):
            answers.append(answer)
            for row in () if options.json else answer["runs"]:
                told = answer["parts"][row["part"] - 1]
                span = f"{told['from_s']:6.1f} to {told['to_s']:.1f} s"
                print(f"{span}  {row['controller']}  {row['mean_distance_m']:.3f} m  {told['words']}")
            if not options.json:
                print(f"saved in {answer['out']}/: {listed(Path(answer['out']))}")
    if options.json:
        print(json.dumps(finite(answers[0] if len(answers) == 1 else {"stories": answers})))
    return INTERRUPTED if stop.requested else 0


def saved_stories(options: Arguments, stop: Interruption) -> Iterator[dict[str, Any]]:
    """Make the stories of a session that the options name again, each in its folder; yield what was saved."""
    from robocov.compiled import compile_kernels
    from robocov.errors import InputError
    from robocov.files.result_folder import results
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
        with results(out, "story", overwrite=options.overwrite) as result:
            save_session(result.new / f"session{path.suffix}", document, node, step, saved.view)
            try:
                answer = {"out": str(out), **save_story(document, node, step, result, options, stop)}
            except InputError as error:
                raise InputError(f"{path}: {error}") from None
            result.keep()
        yield answer
        if stop.requested:
            return


def print_summary(run: Run) -> None:
    """Print what is worth knowing of a run."""
    from robocov_app.render.density import density_lines

    summary, record = run.summary, run.record
    settled = summary["settled_at_s"]
    first = run.history.mean_distance[0]
    path = sum(summary["path_length_m"]) / len(summary["path_length_m"])
    print(f"{record.label} on {record.environment.name}, {len(record.team)} robots, {record.time[-1]:.1f} s")
    print(f"  mean distance   {summary['mean_distance_m']:.3f} m   (at the start {first:.3f} m)")
    if run.history.mean_time is not None:
        at_first = f"(at the start {run.history.mean_time[0]:.3f} s)"
        print(f"  mean time       {summary['mean_time_s']:.3f} s   {at_first}")
    print(f"  coverage cost   {summary['cost_m3']:.2f} m³")
    for line in density_lines(record.environment):
        print(f"  {line}")
    if summary["uncovered_area_m2"] > 0:
        print(f"  uncovered area  {summary['uncovered_area_m2']:.2f} m²   (cut off from every robot)")
    print(f"  settled         {'not yet' if settled is None else f'after {settled:.1f} s'}")
    print(
        f"  contacts        {summary['contacts']}   (smallest clearance {summary['min_clearance_m']:.3f} m)"
    )
    print(f"  path length     {path:.2f} m per robot")
