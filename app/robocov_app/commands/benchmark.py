"""`robocov benchmark`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from robocov.errors import InputError, ParameterError, format_count, require_number
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.arguments import parse_gains
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import BOLD, RIGHT, echo, print_answer, print_table

FAILED = 1
_USED = {  # the options that each action has beside --json
    "run": ("controller", "set", "track", "maps", "quick", "out", "workers", "scheduler"),
    "suite": (),
    "verify": ("paths", "controller", "sample", "seed", "workers"),
    "page": ("paths", "alone", "out", "title"),
    "references": ("out", "workers"),
}


@dataclass
class Arguments(JsonOption):
    """Rate a controller on frozen maps, tracks, starts and seeds, by gaps to the best placements known.

    `robocov benchmark --controller NAME --out DIR` does all runs, and goes on where it was whatever ends it;
    DIR/result.json is small, and `robocov benchmark verify DIR` does a sample of its runs again, bit for bit.
    `robocov benchmark page DIR ... --out FILE.html` compares them with the built-in controllers, whose
    results the package holds; without DIR these alone. `suite` lists tracks and families; `references` makes
    the best placements that the suite's file lacks. The controller `oracle` knows them.

    Example: robocov benchmark --controller mine.py:Mine --quick --out mine
    """

    action: Annotated[
        tyro.conf.Positional[Literal["run", "suite", "verify", "page", "references"]],
        tyro.conf.arg(metavar="[ACTION]"),
    ] = "run"
    """run, suite, verify, page or references."""
    paths: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="[DIR ...]")] = ()
    """Results, for verify and page."""
    controller: str | None = None
    """Name of a controller, or FILE.py:CLASS, or oracle; with verify only for one in a file."""
    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="GAIN=VALUE ...")] = ()
    """Gains that are not at their defaults."""
    track: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TRACK ...")] = ()
    """Only these tracks."""
    maps: Annotated[tuple[str, ...], tyro.conf.arg(metavar="MAP ...")] = ()
    """Only these maps."""
    quick: bool = False
    """Two tracks, with the first map of each family and one seed."""
    out: Path | None = None
    """Folder for the runs and their result, by default benchmark; or the page; or another references file."""
    workers: int | None = None
    """Processes on this machine; by default one a processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler, whose workers do the runs."""
    sample: int = 5
    """How many runs are done again."""
    seed: int = 0
    """Another seed, another sample."""
    alone: bool = False
    """The page leaves out the built-in controllers."""
    title: str = "Benchmark of coverage controllers"
    """Of the page."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024, whole=True)
        require_number("--sample", self.sample, 0, 1_000_000, whole=True)
        require_number("--seed", self.seed, 0, 2**63 - 1, whole=True)
        for names in _USED.values():
            for name in names:
                default = type(self).__dataclass_fields__[name].default
                if getattr(self, name) != default and name not in _USED[self.action]:
                    option = "DIR" if name == "paths" else f"--{name}"
                    raise ParameterError(f"{option}: robocov benchmark {self.action} has no such option")
        if self.action == "run" and self.controller is None:
            raise ParameterError("--controller: expected the name of one, or FILE.py:CLASS, got none")
        verify, paths = self.action == "verify", format_count(len(self.paths), "path")
        if (verify and len(self.paths) != 1) or (self.action == "page" and self.alone and not self.paths):
            wanted = "one result" if verify else "results"
            raise ParameterError(f"DIR: expected {wanted} of a benchmark, got {paths}")


def command(options: Arguments) -> int:
    actions = {"run": _run, "suite": _suite, "verify": _verify, "page": _page, "references": _references}
    return actions[options.action](options)


def _run(options: Arguments) -> int:
    from robocov_app.benchmark.rated_controller import RatedController, Selection
    from robocov_app.benchmark.results import RESULT_FILE
    from robocov_app.benchmark.running import run_benchmark

    assert options.controller is not None
    controller = RatedController(options.controller, parse_gains(options.set))
    selection, out = Selection(options.quick, options.track, options.maps), options.out or Path("benchmark")
    where: dict[str, Any] = {"workers": options.workers, "scheduler": options.scheduler}
    with Interruption() as stop:
        result = run_benchmark(controller, selection, out, stop=stop, quiet=options.json, **where)
    if result is None:
        print_answer(options, {"out": str(out), "interrupted": True}, "stopped; the same command goes on")
        return INTERRUPTED
    runs, failed = len(result["rows"]), sum("error" in row for row in result["rows"])
    if not options.json:
        from robocov_app.benchmark.ratings import build_summary_rows

        (first, *others), rows = build_summary_rows(result)
        print_table([(first, BOLD), *((name, RIGHT) for name in others)], rows)
    words = f"{format_count(runs, 'run')}, {failed} failed; written to {out / RESULT_FILE}"
    print_answer(options, {"out": str(out), "runs": runs, "failed": failed}, words)
    return FAILED if failed else 0


def _suite(options: Arguments) -> int:
    from robocov_app.benchmark import suite

    if options.json:
        tracks = {name: {"maps": track.maps, "seeds": track.seeds} for name, track in suite.TRACKS.items()}
        print_answer(options, {"version": suite.VERSION, "tracks": tracks, "quick": suite.QUICK_TRACKS})
        return 0
    rows = []
    for name, track in suite.TRACKS.items():
        counts = len(track.maps), len(track.maps) * len(track.seeds), track.robots
        rows.append((name, *map(str, counts), track.summary))
    columns = [("Track", BOLD), ("Maps", RIGHT), ("Runs", RIGHT), ("Robots", RIGHT), ("", {})]
    print_table(columns, rows, title=f"Suite {suite.VERSION}; --quick takes {', '.join(suite.QUICK_TRACKS)}")
    echo()
    families = [(name, ", ".join(own)) for name, own in suite.FAMILIES.items()]
    print_table([("Family", BOLD), ("Maps", {})], families)
    return 0


def _verify(options: Arguments) -> int:
    from robocov_app.benchmark.verification import verify_result
    from robocov_app.sweep.executors import processors

    how: dict[str, Any] = {"controller": options.controller, "sample": options.sample, "seed": options.seed}
    with Interruption() as stop:
        how |= {"workers": options.workers or processors(), "stop": stop, "quiet": options.json}
        count, found = verify_result(options.paths[0], **how)
        if stop.requested:
            return INTERRUPTED
    verdict = format_count(len(found), "difference") if found else "all alike, bit for bit"
    answer = {"path": str(options.paths[0]), "runs": count, "differences": found}
    print_answer(options, answer, *found, f"{format_count(count, 'run')} done again: {verdict}")
    return FAILED if found else 0


def _page(options: Arguments) -> int:
    from robocov.files.writing import replace_file
    from robocov_app.benchmark.page import build_page
    from robocov_app.benchmark.results import load_bundled_results, read_result
    from robocov_app.commands.report import check_target

    target = options.out or Path("benchmark.html")
    check_target(target, overwrite=False)
    results = [read_result(path) for path in options.paths]
    results += [] if options.alone else load_bundled_results(results)
    data = build_page(results, options.title).encode("utf-8", "replace")
    with replace_file(target) as part:
        part.write_bytes(data)
    answer = {"path": str(target), "bytes": len(data), "entries": len(results)}
    print_answer(options, answer, f"written to {target} ({len(data) / 1e6:.2f} MB)")
    return 0


def _references(options: Arguments) -> int:
    from robocov_app.benchmark import suite
    from robocov_app.benchmark.references import compute_references
    from robocov_app.sweep.executors import processors

    target, workers = options.out or suite.SUITE_FILE, options.workers or processors()
    if target.is_dir():
        raise InputError(f"--out: {target}: expected a file for the references, got a folder")
    with Interruption() as stop:
        held, left = compute_references(target, workers=workers, quiet=options.json, stop=stop)
    answer = {"path": str(target), "references_and_bounds": held, "left": left}
    print_answer(options, answer, f"{target}: {held} references and bounds, {left} left")
    return INTERRUPTED if left else 0
