"""`robocov generate`."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import tyro

from robocov.environment import Environment
from robocov.errors import (
    InputError,
    MapError,
    OutputError,
    ParameterError,
    describe_error,
    format_count,
    require_number,
)
from robocov.files.writing import resolve_target
from robocov.mapfile import dump_map, list_bundled_maps, load_map, save_map
from robocov.mapfile.check import check_map
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import check_output_file, echo, print_answer
from robocov_app.terminal.progress import show_progress

KindName: TypeAlias = Literal["polygons", "blocks", "rooms", "mazes", "caves"]
MOST = 10_000  # maps that are generated in one call at most
_SIDE = 10.0
_SETTLED = ("kind", "seed", "obstacles", "area", "gap", "side", "width", "height", "count")
"""Options that say what maps are like, and how many; a study has settled them."""


@dataclass
class Arguments(FigureOptions):
    """Make random maps, by a seed: the same words give the same map.

    The kinds are polygons (scattered obstacles), blocks (a town), rooms (a building), mazes and caves. The
    free space of each is one piece, no passage of it is narrower than the gap, and it has the starts
    corner, centre and uniform. Without --out the map is printed.

    With --count the maps of as many seeds, one after the other, go to a folder.
    With --study the maps go there that robocov paper draws by chance, with its starts.
    --plot draws the maps on one sheet.

    Example: robocov generate --kind rooms --seed 3 --obstacles 8 --area 0.2 --gap 0.6 --out map.json
    """

    kind: KindName = "polygons"
    """What the map is like."""
    seed: int = 0
    """A whole number; with --count that of the first map."""
    obstacles: int | None = None
    """How many obstacles, blocks or rooms; of mazes about how many cells, of caves chambers."""
    area: float | None = None
    """Blocked area, as a part of the map's; what suits the kind by default."""
    gap: float = 0.6
    """Least width of every passage in metres."""
    side: float = _SIDE
    """Side of a square map in metres."""
    width: float | None = None
    """Width of a map that is no square, in metres; with --height."""
    height: float | None = None
    """Height of a map that is no square, in metres; with --width."""
    count: int | None = None
    """How many maps to put in a folder."""
    study: Literal["full", "quick"] | None = None
    """The maps of robocov paper, or of robocov paper --quick, in place of all the options above."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")] = None
    """The file to write; with --count and --study the folder."""
    overwrite: bool = False
    """Replace earlier maps of the same names."""

    def __post_init__(self) -> None:
        for field in fields(Arguments) if self.study is not None else ():
            value = getattr(self, field.name)
            if field.name in _SETTLED and value != field.default:
                raise InputError(f"--{field.name}: {value}, but --study says what its maps are like")
        if self.count is not None:
            require_number("--count", self.count, 1, MOST)
        if (self.width is None) != (self.height is None):
            given, missing = ("width", "height") if self.height is None else ("height", "width")
            raise InputError(f"--{given}: requires --{missing}")
        if self.side != _SIDE and self.width is not None:
            raise InputError(f"--side: {self.side:g}, but --width and --height say how large the map is")
        super().__post_init__()


def command(options: Arguments) -> None:
    out, several = options.out, bool(options.count or options.study)
    check_out(out, folder=several, overwrite=options.overwrite)
    jobs, rows = jobs_of(options), []
    made: list[Environment] = []
    with show_progress("generating", len(jobs), quiet=options.json or not several) as update:
        for number, (name, make) in enumerate(jobs, start=1):
            path = out / f"{name}.json" if out is not None and several else out
            if path is not None and several:
                _require_map(path)
            try:
                environment = make()
            except ParameterError as error:  # its messages begin with the name of the parameter
                of_seed = "" if options.count is None else f" (seed {options.seed + number - 1})"
                raise ParameterError(f"--{error}{of_seed}") from None
            made.append(environment)
            if path is None:
                echo(dump_map(environment), end="")
            else:
                save_map(environment, path)
                rows.append({"file": str(path), **check_map(environment).to_dict()})
            update(number)
    if options.plot is not None:
        from robocov_app.figures.files import save_figure
        from robocov_app.figures.runs import plot_maps

        save_figure(plot_maps(made, options.theme), options.plot)
    if out is not None:
        print_answer(options, {"out": str(out), "maps": rows}, *map(_facts, rows), indent=1)


def _facts(row: dict[str, Any]) -> str:
    gap = row["narrowest_gap_m"]
    facts = [f"{row['file']}: {row['free_area_m2']:.4g} of {row['area_m2']:.4g} m² free"]
    facts += ["no passage" if gap is None else f"narrowest gap {gap:.3f} m"]
    return ", ".join([*facts, format_count(row["obstacles"], "obstacle"), f"{row['vertices']} vertices"])


def check_out(out: Path | None, *, folder: bool, overwrite: bool) -> None:
    if folder:
        if out is None:
            raise InputError("--out: required with --count and --study, as the folder of the maps")
        try:
            out.mkdir(parents=True, exist_ok=True)
            used = any(out.iterdir())
        except OSError as error:
            raise OutputError(f"{out}: cannot be used for maps: {describe_error(error)}") from error
        if used and not overwrite:
            raise InputError(f"{out}: the folder is not empty; choose another --out or pass --overwrite")
    elif out is not None:
        if out.is_dir() or not out.name:
            wanted = "expected the name of a file (--count makes a folder)"
            raise InputError(f"--out: {wanted}, got {str(out)!r}")
        check_output_file(out, "another --out", overwrite=overwrite)


def _require_map(path: Path) -> None:
    if resolve_target(path).exists():
        try:
            load_map(path)
        except MapError:
            why = "is no map of robocov, so --overwrite leaves it alone; choose another --out"
            raise InputError(f"{path}: {why}") from None


def jobs_of(options: Arguments) -> list[tuple[str, Callable[[], Environment]]]:
    """Return names of maps, and what makes them: of the seeds, or of a study of the paper."""
    if options.study is None:
        from robocov.generator import generate_map

        names = "kind", "obstacles", "area", "gap", "side", "width", "height"
        words = {name: getattr(options, name) for name in names}
        seeds = range(options.seed, options.seed + (options.count or 1))
        kind, digits = options.kind, len(str(seeds[-1]))
        return [(f"{kind}-{seed:0{digits}}", partial(generate_map, seed, **words)) for seed in seeds]
    from robocov_app.replication.plan import FULL, QUICK
    from robocov_app.replication.studies import claim_maps, convex_maps, generated_maps

    plan = FULL if options.study == "full" else QUICK
    maps, bundled = (*claim_maps(plan), *generated_maps(plan.tuning), *convex_maps(plan)), list_bundled_maps()
    return [(each.name, partial(replace, each.environment)) for each in maps if each.name not in bundled]
