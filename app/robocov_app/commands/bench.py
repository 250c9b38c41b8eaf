"""`robocov bench`."""

from __future__ import annotations

import importlib.util
import os
import platform
from dataclasses import dataclass
from importlib.metadata import version
from itertools import groupby
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from robocov.errors import ParameterError
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import RIGHT, create_console, echo, print_answer, print_table
from robocov_app.terminal.progress import report_compilation, show_progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov_app.bench.measure import Row

PARTS = {
    # part: title, module, its function
    "step": ("A step of RAPF on campus", "step", "cases"),
    "maps": ("The exact coverage cost on maps", "cost", "map_cases"),
    "cost": ("The exact coverage cost in a unit square with random obstacles", "cost", "cases"),
    "learning": (
        "Learning environments on rooms, with the exact cost in the reward of each step", "learning", "cases"
    ),
    "sweep": ("A sweep of short runs on three maps, processor time", "processes", "cases"),
    "render": ("Pictures of 1280 x 720", "render", "cases"),
    "window": ("The window of 1280 x 720 on rooms, in use", "window", "cases"),
    "start": ("Until a command begins", "processes", "start_cases"),
}  # fmt: skip

PartName = Literal["step", "maps", "cost", "learning", "sweep", "render", "window", "start", "all"]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass
class Arguments(FigureOptions):
    """Measure speed, as ratios to yardsticks that are taken in turn with it, on one thread.

    Times on a shared machine mean little; ratios of medians taken in one run hold. The yardstick of
    the cost is scikit-fmm: pip install 'robocov[bench]'. All takes a minute or two.

    Example: robocov bench step
    """

    part: Annotated[tyro.conf.Positional[PartName], tyro.conf.arg(metavar="PART")] = "all"
    """Part to measure; learning needs 'robocov[rl]', cost 'robocov[bench]'."""
    quick: bool = False
    """Fewer cases and rounds: some ten seconds."""


def command(options: Arguments) -> None:
    for name in THREADS:  # read when numpy is loaded, which telling of compiling does
        os.environ.setdefault(name, "1")
    report_compilation()
    parts = list(PARTS) if options.part == "all" else [options.part]
    if options.part == "all" and importlib.util.find_spec("gymnasium") is None:
        parts.remove("learning")
    modules = {part: importlib.import_module(f"robocov_app.bench.{PARTS[part][1]}") for part in parts}
    if "cost" in parts and not modules["cost"].has_yardstick():
        missing = "scikit-fmm, the yardstick of the cost, is not installed: pip install 'robocov[bench]'"
        if options.part == "cost":
            raise ParameterError(missing)
        echo(f"robocov: {missing}", to_stderr=True)
    cases = [case for part in parts for case in getattr(modules[part], PARTS[part][2])(quick=options.quick)]
    rows, stopped = [], None
    try:
        with show_progress("measuring", len(cases), quiet=options.json) as update:
            for done, case in enumerate(cases, start=1):
                rows.extend(case())
                update(done)
    except KeyboardInterrupt as error:
        stopped = error
    if options.plot is not None and rows:
        from robocov_app.bench.plot import save_ratios
        from robocov_app.render.theme import theme_named

        save_ratios(rows, options.plot, theme_named(options.theme))
    packages = {name: version(name) for name in ("numpy", "scipy", "shapely", "pymunk", "pygame-ce")}
    machine: dict[str, Any] = {"python": platform.python_version(), "system": platform.system()}
    machine |= {"processor": platform.machine(), "cores": os.cpu_count(), "packages": packages}
    print_answer(options, {"machine": machine, "rows": [row.to_dict() for row in rows]}, indent=1)
    if not options.json:
        print_tables(rows)
        out, told = create_console(), ", ".join(f"{name} {number}" for name, number in packages.items())
        out.print("before: about the ratio when nothing was compiled (commit 8838167)")
        out.print(f"Python {machine['python']}, {machine['system']}, {machine['cores']} cores; {told}")
    if stopped is not None:
        raise stopped


def print_tables(rows: Sequence[Row]) -> None:
    numbers = [(title, RIGHT) for title in ("time", "yardstick", "ratio", "before", "goal")]
    columns = [("", {}), ("", {}), *numbers, ("", {"no_wrap": True}), ("", {})]
    for part, group in groupby(rows, key=lambda row: row.part):
        cells, former = [], ""
        for row in group:
            words = row.case or row.name
            case = "" if words == former else words, row.name if row.case else ""
            times = (duration(each) for each in (row.seconds, row.yardstick_seconds))
            ratios = ("" if each is None else f"{each:.2f}" for each in (row.ratio, row.before))
            yardstick = "" if row.yardstick is None else f"/ {row.yardstick}"
            cells.append((*case, *times, *ratios, goals(row), yardstick, row.note))
            former = words
        print_table(columns, cells, title=PARTS[part][0])
        echo()


def goals(row: Row) -> str:
    wanted = [] if row.goal is None or row.ratio is None else [f"{row.goal:.3g}"]
    wanted += [] if row.goal_seconds is None else [duration(row.goal_seconds)]
    return ", ".join(wanted) + " missed" * (row.met is False)


def duration(seconds: float | None) -> str:
    if seconds is None:
        return ""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.1f} ms" if seconds < 1.0 else f"{seconds:.2f} s"
