"""`robocov bench`."""

from __future__ import annotations

import importlib.util
import os
import platform
from dataclasses import dataclass
from importlib.metadata import version
from itertools import groupby
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import tyro

from robocov.errors import ParameterError
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import RIGHT, create_console, echo, print_answer, print_table
from robocov_app.terminal.progress import report_compilation, show_progress

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from robocov_app.speed_benchmarks.measure import Row


class Part(NamedTuple):
    """A part of the measurements.

    Attributes
    ----------
    title : str
        Title of its table.
    module : str
        Name of a module in `robocov_app.speed_benchmarks`.
    function : str
        Name of the module's function that returns the cases.
    """

    title: str
    module: str
    function: str = "list_cases"


PARTS = {
    "step": Part("One RAPF step on campus", "step"),
    "maps": Part("Exact coverage cost on maps", "cost", "list_map_cases"),
    "cost": Part("Exact coverage cost in a unit square with random obstacles", "cost"),
    "learning": Part("Learning environments on rooms (exact cost in the reward of each step)", "learning"),
    "sweep": Part("Sweep of short runs on three maps (CPU time)", "processes"),
    "render": Part("Rendering of frames (1280 x 720)", "render"),
    "window": Part("Interactive window on rooms (1280 x 720)", "window"),
    "start": Part("Start-up time of commands", "processes", "list_start_cases"),
}
"""The parts by name, in the order in which they are measured."""
PartName = Literal["step", "maps", "cost", "learning", "sweep", "render", "window", "start", "all"]
"""Names of the parts, for the command line."""
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit the number of threads of linear algebra."""
_PACKAGES = ("numpy", "scipy", "shapely", "pymunk", "pygame-ce")
"""Packages whose versions are printed."""


@dataclass
class Arguments(FigureOptions):
    """Measure speed on one thread, as ratios to baselines that are timed in alternation.

    Times on a shared machine mean little; ratios of medians from the same run are stable. The baseline of
    the cost is scikit-fmm: pip install 'robocov[bench]'. All parts take a minute or two.

    Example: robocov bench step
    """

    part: Annotated[tyro.conf.Positional[PartName], tyro.conf.arg(metavar="[PART]")] = "all"
    """Part to measure; learning needs 'robocov[rl]', cost 'robocov[bench]'."""
    quick: bool = False
    """Fewer cases and rounds: about ten seconds."""


def command(options: Arguments) -> None:
    """Run `robocov bench`."""
    # numpy reads these variables when it is loaded, which `report_compilation` does.
    for name in _THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    with report_compilation():
        cases = _collect_cases(options.part, is_quick=options.quick)
        rows, interruption = _measure(cases, quiet=options.json)
    if options.plot is not None and rows:
        from robocov_app.look.theme import get_theme
        from robocov_app.speed_benchmarks.plot import save_ratios

        save_ratios(rows, options.plot, get_theme(options.theme))
    machine = _describe_machine()
    if options.json:
        print_answer(options, {"machine": machine, "rows": [row.to_dict() for row in rows]}, indent=1)
    else:
        _print_tables(rows)
        _print_machine(machine)
    # Raised only now, so that the results so far are printed.
    if interruption is not None:
        raise interruption


def _collect_cases(part_name: PartName, *, is_quick: bool) -> list[Callable[[], Sequence[Row]]]:
    """Collect the measurements of a part or of all parts.

    Raises
    ------
    ParameterError
        If the baseline of the part is not installed.
    """
    names: list[str] = [part_name]
    if part_name == "all":
        names = list(PARTS)
        if importlib.util.find_spec("gymnasium") is None:
            names.remove("learning")
    modules = {
        name: importlib.import_module(f"robocov_app.speed_benchmarks.{PARTS[name].module}") for name in names
    }
    if "cost" in names and not modules["cost"].has_baseline():
        message = "scikit-fmm, the baseline of the cost, is not installed: pip install 'robocov[bench]'"
        if part_name == "cost":
            raise ParameterError(message)
        echo(f"robocov: {message}", to_stderr=True)
    cases = []
    for name, module in modules.items():
        list_cases = getattr(module, PARTS[name].function)
        cases += list_cases(quick=is_quick)
    return cases


def _measure(
    cases: Sequence[Callable[[], Sequence[Row]]], *, quiet: bool
) -> tuple[list[Row], KeyboardInterrupt | None]:
    """Measure the cases.

    Returns
    -------
    rows : list of Row
        Results of the cases so far.
    interruption : KeyboardInterrupt or None
        The exception if the user interrupts the measurements.
    """
    rows: list[Row] = []
    try:
        with show_progress("measuring", len(cases), quiet=quiet) as update:
            for number, case in enumerate(cases, start=1):
                rows.extend(case())
                update(number)
    except KeyboardInterrupt as error:
        return rows, error
    return rows, None


def _describe_machine() -> dict[str, Any]:
    """Return the versions, the processor and the system, as JSON content."""
    return {
        "python": platform.python_version(),
        "system": platform.system(),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "packages": {name: version(name) for name in _PACKAGES},
    }


def _print_machine(machine: dict[str, Any]) -> None:
    """Print the versions and the number of cores, below an explanation of the column "before"."""
    console = create_console()
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    console.print("before: approximate ratio of the first version, in which no code was compiled")
    console.print(f"Python {machine['python']}, {machine['system']}, {machine['cores']} cores; {packages}")


def _print_tables(rows: Sequence[Row]) -> None:
    """Print a table for each part."""
    columns: list[tuple[str, Any]] = [("", {}), ("", {})]
    columns += [(title, RIGHT) for title in ("time", "baseline", "ratio", "before", "goal")]
    columns += [("", {"no_wrap": True}), ("", {})]
    for part_name, part_rows in groupby(rows, key=lambda row: row.part):
        cells = []
        previous_case = ""
        for row in part_rows:
            case = row.case
            name = row.name
            if not case:
                case = row.name
                name = ""
            displayed_case = "" if case == previous_case else case
            cells.append((displayed_case, name, *_format_measurement(row)))
            previous_case = case
        print_table(columns, cells, title=PARTS[part_name].title)
        echo()


def _format_measurement(row: Row) -> list[str]:
    """Return the table cells with the numbers of a measurement."""
    return [
        format_duration(row.seconds),
        format_duration(row.baseline_seconds),
        _format_ratio(row.ratio),
        _format_ratio(row.earlier_ratio),
        format_goals(row),
        "" if row.baseline is None else f"/ {row.baseline}",
        row.note,
    ]


def _format_ratio(ratio: float | None) -> str:
    """Return a ratio as text; empty for None."""
    if ratio is None:
        return ""
    return f"{ratio:.2f}"


def format_goals(row: Row) -> str:
    """Format the goals of a measurement, followed by "missed" if they are not met.

    Parameters
    ----------
    row : Row
        The measurement.

    Returns
    -------
    str
        An empty text if there are no goals.
    """
    goals = []
    if row.max_ratio is not None and row.ratio is not None:
        goals.append(f"{row.max_ratio:.3g}")
    if row.max_seconds is not None:
        goals.append(format_duration(row.max_seconds))
    text = ", ".join(goals)
    if row.meets_goals is False:
        text += " missed"
    return text


def format_duration(seconds: float | None) -> str:
    """Format a duration.

    Parameters
    ----------
    seconds : float or None, s
        The duration; None if it is unknown.

    Returns
    -------
    str
        Empty for None.

    Examples
    --------
    >>> format_duration(0.012), format_duration(2.5)
    ('12.0 ms', '2.50 s')
    """
    if seconds is None:
        return ""
    # The limits apply to the rounded values, so that the text is neither "1000 µs" nor "1000.0 ms".
    if round(seconds * 1e6) < 1000:
        return f"{seconds * 1e6:.0f} µs"
    if round(seconds * 1e3, 1) < 1000.0:
        return f"{seconds * 1e3:.1f} ms"
    return f"{seconds:.2f} s"
