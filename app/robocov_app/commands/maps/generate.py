"""`robocov generate`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, TypeAlias

import tyro

from robocov.environment import Environment
from robocov.errors import (
    InputError,
    MapError,
    NoLayoutError,
    OutputError,
    ParameterError,
    describe_error,
    format_area,
    format_count,
    require_number,
)
from robocov.files.writing import resolve_target
from robocov.mapfile import dump_map, list_bundled_maps, load_map, save_map
from robocov.mapfile.check import MapReport, check_map
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import check_output_file, echo, print_answer
from robocov_app.terminal.progress import show_progress

if TYPE_CHECKING:
    from robocov_app.sweep.study.study import StudyMap

KindName: TypeAlias = Literal["polygons", "blocks", "rooms", "mazes", "caves"]
"""Kinds of generated maps."""
MAX_MAPS = 10_000
"""Maximum number of maps that are generated in one call."""
_DEFAULT_SIDE_M = 10.0
"""Default side of a square map."""
_FIXED_BY_STUDY = ("kind", "seed", "obstacles", "area", "gap", "side", "width", "height", "count")
"""Options that cannot be combined with ``--study``, which fixes the kind and the number of maps."""


@dataclass
class Arguments(FigureOptions):
    """Generate random maps from a seed; the same options give the same map.

    The kinds are polygons (scattered obstacles), blocks (a town), rooms (a building), mazes and caves. The
    free space is connected, no passage is narrower than --gap, and the starts are corner, center and
    uniform. Without --out the map is printed.

    --count writes the maps of consecutive seeds to a folder, --study the random maps of robocov paper with
    their starts. --plot draws all maps on one sheet.

    Example: robocov generate --kind rooms --seed 3 --gap 0.8 --out map.json
    """

    kind: KindName = "polygons"
    """Kind of map."""
    seed: int = 0
    """Seed of the map; with --count that of the first map."""
    obstacles: int | None = None
    """Number of obstacles, blocks or rooms; approximate number of cells of a maze, or chambers of a cave."""
    area: float | None = None
    """Blocked fraction of the area; the default depends on the kind."""
    gap: float = 0.6
    """Minimum width of passages, m."""
    side: float = _DEFAULT_SIDE_M
    """Side of a square map, m."""
    width: float | None = None
    """Width of a rectangular map, m; with --height."""
    height: float | None = None
    """Height of a rectangular map, m; with --width."""
    count: int | None = None
    """Number of maps to write to a folder."""
    study: Literal["full", "quick"] | None = None
    """Maps of robocov paper, or of robocov paper --quick, instead of all the options above."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")] = None
    """File to write; with --count and --study the folder."""
    overwrite: bool = False
    """Replace earlier maps with the same names."""

    def __post_init__(self) -> None:
        """Check that the options are in range and do not contradict each other."""
        if self.study is not None:
            self._check_study_options()
        if self.count is not None:
            require_number("--count", self.count, 1, MAX_MAPS)
        if self.width is not None and self.height is None:
            raise InputError("--width: requires --height")
        if self.height is not None and self.width is None:
            raise InputError("--height: requires --width")
        if self.side != _DEFAULT_SIDE_M and self.width is not None:
            raise InputError(f"--side: cannot be combined with --width and --height, got {self.side:g}")
        super().__post_init__()

    def _check_study_options(self) -> None:
        """Raise an InputError if an option is given that ``--study`` fixes."""
        for field in fields(Arguments):
            value = getattr(self, field.name)
            if field.name in _FIXED_BY_STUDY and value != field.default:
                message = f"cannot be combined with --study, which gives its value; got {value}"
                raise InputError(f"--{field.name}: {message}")

    @property
    def writes_folder(self) -> bool:
        """Whether the maps are written to a folder."""
        return self.count is not None or self.study is not None


class _MapTask(NamedTuple):
    """A map to build."""

    name: str
    """File name of the map, without the suffix."""
    build: Callable[[], Environment]
    """Builds the map."""
    reported_seed: int | None = None
    """Seed that error messages name, in a series of consecutive seeds; otherwise None."""


def command(options: Arguments) -> None:
    """Run `robocov generate`."""
    out = options.out
    if options.writes_folder:
        _prepare_folder(out, overwrite=options.overwrite)
    elif out is not None:
        _check_file(out, overwrite=options.overwrite)
    tasks = _list_tasks(options)
    environments = []
    reports = {}
    is_quiet = options.json or not options.writes_folder
    with show_progress("generating", len(tasks), quiet=is_quiet) as update:
        for number, task in enumerate(tasks, start=1):
            path = out
            if out is not None and options.writes_folder:
                path = out / f"{task.name}.json"
                _require_replaceable(path)
            environment = _build_map(task)
            environments.append(environment)
            if path is None:
                echo(dump_map(environment), end="")
            else:
                save_map(environment, path)
                reports[path] = check_map(environment)
            update(number)
    if options.plot is not None:
        _save_sheet(options, options.plot, environments)
    if out is not None:
        _print_reports(options, out, reports)


def _build_map(task: _MapTask) -> Environment:
    """Build a map. Error messages name the option and, in a series of maps, the seed without a layout."""
    try:
        return task.build()
    except ParameterError as error:
        # The message begins with the name of the parameter, which is also that of the option.
        message = f"--{error}"
        if isinstance(error, NoLayoutError) and task.reported_seed is not None:
            message += f" (seed {task.reported_seed})"
        raise ParameterError(message) from None


def _save_sheet(options: Arguments, path: Path, environments: list[Environment]) -> None:
    """Draw the maps on one sheet."""
    from robocov_app.figures.files import save_figure
    from robocov_app.figures.map_sheets import plot_maps

    save_figure(plot_maps(environments, options.theme), path)


def _print_reports(options: Arguments, out: Path, reports: Mapping[Path, MapReport]) -> None:
    """Print the reports on the maps by their files: one line each, or all measures as JSON."""
    if options.json:
        rows = [{"file": str(path), **report.to_dict()} for path, report in reports.items()]
        print_answer(options, {"out": str(out), "maps": rows}, indent=1)
        return
    for path, report in reports.items():
        echo(f"{path}: {_describe_map(report)}")


def _describe_map(report: MapReport) -> str:
    """Return the most important properties of a map as a line of text."""
    passages = "no passage"
    if report.narrowest_gap is not None:
        passages = f"narrowest passage {report.narrowest_gap.width:.3f} m"
    obstacles = format_count(report.obstacle_count, "obstacle")
    free_area = f"{format_area(report.free_area)} of {format_area(report.area)} free"
    return f"{free_area}, {passages}, {obstacles}, {report.vertex_count} vertices"


def _prepare_folder(folder: Path | None, *, overwrite: bool) -> None:
    """Create the folder for the maps.

    Raise an InputError if none is given or it is not empty, and an OutputError if it cannot be created.
    """
    if folder is None:
        raise InputError("--out: --count and --study require a folder for the maps")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        is_empty = not any(folder.iterdir())
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for maps: {describe_error(error)}") from error
    if not is_empty and not overwrite:
        raise InputError(f"{folder}: the folder is not empty; choose another --out or pass --overwrite")


def _check_file(path: Path, *, overwrite: bool) -> None:
    """Raise an InputError if the file of a single map may not be written."""
    if path.is_dir() or not path.name:
        raise InputError(f"--out: expected the name of a file (--count makes a folder), got {str(path)!r}")
    check_output_file(path, "another --out", overwrite=overwrite)


def _require_replaceable(path: Path) -> None:
    """Raise an InputError if a file exists that is not a map of robocov.

    Only for files in a folder: their names are not given by the user, so ``--overwrite`` may only replace
    earlier maps.
    """
    if not resolve_target(path).exists():
        return
    try:
        load_map(path)
    except MapError:
        reason = "is not a map of robocov, and --overwrite does not replace it; choose another --out"
        raise InputError(f"{path}: {reason}") from None


def _list_tasks(options: Arguments) -> list[_MapTask]:
    """List the maps to build: one per consecutive seed, or those of a study of the paper."""
    if options.study is not None:
        return _list_study_tasks(is_quick=options.study == "quick")
    from robocov.generator import generate_map

    names = ("kind", "obstacles", "area", "gap", "side", "width", "height")
    parameters = {name: getattr(options, name) for name in names}
    seeds = range(options.seed, options.seed + (options.count or 1))
    digits = len(str(seeds[-1]))
    return [
        _MapTask(
            name=f"{options.kind}-{seed:0{digits}}",
            build=partial(generate_map, seed, **parameters),
            # With one map, the user knows the seed.
            reported_seed=None if options.count is None else seed,
        )
        for seed in seeds
    ]


def _list_study_tasks(*, is_quick: bool) -> list[_MapTask]:
    """List the generated maps of a study of the paper, without the bundled maps."""
    from robocov_app.replication.design.plan import FULL, QUICK
    from robocov_app.replication.design.study_maps import (
        build_claim_maps,
        build_convex_maps,
        build_tuning_maps,
    )

    plan = QUICK if is_quick else FULL
    study_maps = [*build_claim_maps(plan), *build_tuning_maps(plan), *build_convex_maps(plan)]
    bundled_maps = list_bundled_maps()
    return [
        _MapTask(study_map.name, partial(_get_environment, study_map))
        for study_map in study_maps
        if study_map.name not in bundled_maps
    ]


def _get_environment(study_map: StudyMap) -> Environment:
    return study_map.environment
