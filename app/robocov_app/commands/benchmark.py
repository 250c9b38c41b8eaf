"""`robocov benchmark`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from robocov.errors import MAX_SEED, InputError, ParameterError, format_count, require_number
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.arguments import parse_gains
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import BOLD, RIGHT, echo, print_answer, print_table

FAILED = 1
"""Exit status if runs failed, a result differs from its verification, or no run was repeated."""
_OPTIONS_BY_ACTION = {
    "run": ("controller", "set", "track", "maps", "quick", "out", "workers", "scheduler"),
    "suite": (),
    "verify": ("paths", "controller", "sample", "robots", "new_maps", "seed", "workers"),
    "page": ("paths", "alone", "out", "title"),
    "references": ("out", "workers"),
}
"""The options of each action, in addition to --json."""
_EXPLANATIONS = {
    "Score, %": "Score: mean of J_ref / J over the runs; J is the final cost, J_ref that of the best known "
    "placement.\n  Halved for a run with a contact, and halved again if the team has not settled.",
    "Gap, %": "Gap: median of J / J_ref - 1; in brackets that of J / J_bound - 1 for a proven lower bound.\n"
    "  The gap of a failed run is infinite.",
    "95%": "95%: confidence interval of the median gap, for at least 12 maps.",
    "Worst": "Worst: largest gap of a run, %.",
    "Within 5%, s": "Within 5%: time from which the cost stays within 5% of its final value, median.",
    "Path, m": "Path: mean path length of a robot, median.",
    "Runs with contacts": "Runs with contacts: those in which a robot touched a wall or another robot.",
    "Settled": "Settled: runs at whose end the team has settled.",
    "B/s": "B/s: bytes that a robot sends per second, median.",
    "µs/s": "µs/s: computing time of the controller per robot and second of simulation time, median.",
}
"""Explanations of the columns of the table of ratings."""


@dataclass
class Arguments(JsonOption):
    """Rate a controller on frozen maps, tracks, starts and seeds, by gaps to the best known placements.

    The first argument is an action:

      run         (the default) execute the runs, and write DIR/result.json, which is small; after any
                  interruption, the same command resumes
      page        compare the results in DIR ... with those of the built-in controllers, which the package
                  contains; without DIR, show these alone
      verify      repeat a sample of the runs in DIR, bit for bit, with the controller in separate processes
                  for the team and for single robots, and run it on new maps
      suite       list the tracks and maps
      references  compute missing best placements of the suite

    More controllers are available: `oracle` knows the best placements and moves straight to them, and
    `learned` is a neural network that imitates a planner. `coverage-control-clairvoyant`, `-centralized` and
    `-decentralized` are the controllers of the simulator CoverageControl, for the track open-square only;
    they need the extra coverage-control.

    Example: robocov benchmark --controller mine.py:MyController --quick --out mine
    """

    action: Annotated[
        tyro.conf.Positional[Literal["run", "suite", "verify", "page", "references"]],
        tyro.conf.arg(metavar="[ACTION]"),
    ] = "run"
    """run, suite, verify, page or references."""
    paths: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="[DIR ...]")] = ()
    """Results, for verify and page."""
    controller: str | None = None
    """Name of a controller, or FILE.py:CLASS; verify needs it only for FILE.py:CLASS."""
    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="GAIN=VALUE ...")] = ()
    """Gains that differ from their defaults."""
    track: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TRACK ...")] = ()
    """Only these tracks, or all of a ranking (core, plans); `robocov benchmark suite` lists them."""
    maps: Annotated[tuple[str, ...], tyro.conf.arg(metavar="MAP ...")] = ()
    """Only these maps; `robocov benchmark suite` lists them."""
    quick: bool = False
    """Two tracks, with the first map of each family and one seed."""
    out: Path | None = None
    """Folder of the result (default: benchmark); with page or references, the file to write."""
    workers: int | None = None
    """Number of processes on this machine; by default one per processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers execute the runs."""
    sample: int = 10
    """Number of runs that verify repeats; with 0, nothing counts as verified, and the exit status is 1."""
    robots: int = 2
    """Number of robots that verify checks in each repeated run."""
    new_maps: int = 5
    """Number of new maps on which verify runs the controller, at most one of each family, on one track."""
    seed: int | None = None
    """Seed of verify for the sample, the robots and the new maps; by default a new one is drawn."""
    alone: bool = False
    """Leave the built-in controllers out of the page."""
    title: str = "Benchmark of coverage controllers"
    """Page title."""

    def __post_init__(self) -> None:
        """Check the ranges of the options, and that they apply to the action."""
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024, whole=True)
        require_number("--sample", self.sample, 0, 1_000_000, whole=True)
        require_number("--robots", self.robots, 0, 1_000_000, whole=True)
        require_number("--new-maps", self.new_maps, 0, 1_000_000, whole=True)
        if self.seed is not None:
            require_number("--seed", self.seed, 0, MAX_SEED, whole=True)
        self._check_applicable_options()
        if self.action == "run" and self.controller is None:
            raise ParameterError("--controller: expected a controller name or FILE.py:CLASS, got none")
        self._check_paths()

    def _check_applicable_options(self) -> None:
        """Raise a ParameterError for an option that does not apply to the action.

        An option counts as given if it differs from its default.
        """
        for names in _OPTIONS_BY_ACTION.values():
            for name in names:
                default = type(self).__dataclass_fields__[name].default
                is_given = getattr(self, name) != default
                if is_given and name not in _OPTIONS_BY_ACTION[self.action]:
                    option = "DIR" if name == "paths" else f"--{name.replace('_', '-')}"
                    raise ParameterError(f"{option}: not an option of robocov benchmark {self.action}")

    def _check_paths(self) -> None:
        """Raise a ParameterError if the number of results does not fit the action."""
        paths = format_count(len(self.paths), "path")
        if self.action == "verify" and len(self.paths) != 1:
            raise ParameterError(f"DIR: expected one result of a benchmark, got {paths}")
        if self.action == "page" and self.alone and not self.paths:
            raise ParameterError(f"DIR: expected results of a benchmark, got {paths}")


def command(options: Arguments) -> int:
    """Run `robocov benchmark`, and return its exit status."""
    actions = {
        "run": _run,
        "suite": _print_suite,
        "verify": _verify,
        "page": _write_page,
        "references": _compute_references,
    }
    return actions[options.action](options)


def _run(options: Arguments) -> int:
    """Run the benchmark for a controller, print its ratings, and return the exit status."""
    from robocov_app.benchmark.rated_controller import RatedController, Selection
    from robocov_app.benchmark.results import RESULT_FILE
    from robocov_app.benchmark.running import run_benchmark

    assert options.controller is not None
    out = options.out or Path("benchmark")
    with Interruption() as interruption:
        result = run_benchmark(
            RatedController(options.controller, parse_gains(options.set)),
            Selection(options.quick, options.track, options.maps),
            out,
            stop=interruption,
            workers=options.workers,
            scheduler=options.scheduler,
            quiet=options.json,
        )
    if result is None:
        message = f"Interrupted. Partial results are in {out}/. Run the same command to resume."
        print_answer(options, {"out": str(out), "interrupted": True}, message)
        return INTERRUPTED
    runs = len(result["rows"])
    failed = sum("error" in row for row in result["rows"])
    if not options.json:
        _print_ratings(result, out)
    line = f"{format_count(runs, 'run')}, {failed} failed; written to {out / RESULT_FILE}"
    print_answer(options, {"out": str(out), "runs": runs, "failed": failed}, line)
    return FAILED if failed else 0


def _print_ratings(result: dict[str, Any], folder: Path) -> None:
    """Print the table of the ratings on each track, and explain its columns."""
    from robocov_app.benchmark.ratings import build_summary_table

    (first_title, *titles), rows = build_summary_table(result)
    columns = [(first_title, BOLD)]
    columns += [(title, RIGHT) for title in titles]
    print_table(columns, rows)
    for title, explanation in _EXPLANATIONS.items():
        if title in titles:
            echo(explanation)
    echo(f"`robocov benchmark page {folder}` compares this result with the built-in ones.")


def _print_suite(options: Arguments) -> int:
    """Print the tracks and the families of maps."""
    from robocov_app.benchmark import suite

    if options.json:
        tracks = {
            name: {"maps": track.maps, "seeds": track.seeds, "ranking": track.ranking}
            for name, track in suite.TRACKS.items()
        }
        print_answer(options, {"version": suite.VERSION, "tracks": tracks, "quick": suite.QUICK_TRACKS})
        return 0
    rows = []
    for name, track in suite.TRACKS.items():
        runs = len(track.maps) * len(track.seeds)
        ranking = track.ranking or "–"
        rows.append((name, ranking, str(len(track.maps)), str(runs), str(track.robots), track.summary))
    columns = [
        ("Track", BOLD),
        ("Ranking", {}),
        ("Maps", RIGHT),
        ("Runs", RIGHT),
        ("Robots", RIGHT),
        ("", {}),
    ]
    title = f"Suite {suite.VERSION}; --quick takes {', '.join(suite.QUICK_TRACKS)}"
    print_table(columns, rows, title=title)
    echo()
    families = [(name, ", ".join(maps)) for name, maps in {**suite.FAMILIES, **suite.OTHER_FAMILIES}.items()]
    print_table([("Family", BOLD), ("Maps", {})], families)
    return 0


def _verify(options: Arguments) -> int:
    """Verify a result, print the differences, and return the exit status."""
    from robocov_app.benchmark.verification.verification import VerificationOptions, verify_result
    from robocov_app.sweep.local_pool import count_processors

    path = options.paths[0]
    extent = VerificationOptions(
        sample=options.sample,
        robots=options.robots,
        new_maps=options.new_maps,
        seed=options.seed,
        workers=options.workers or count_processors(),
    )
    with Interruption() as interruption:
        verification = verify_result(
            path, controller=options.controller, options=extent, stop=interruption, quiet=options.json
        )
        if interruption.requested:
            message = "Interrupted. The result was not verified."
            print_answer(options, {"path": str(path), "interrupted": True}, message)
            return INTERRUPTED
    differences = verification.differences
    comparison = verification.comparison
    answer = {
        "path": str(path),
        "seed": verification.seed,
        "runs": verification.runs,
        "rows": verification.rows,
        "failed_rows": verification.failed_rows,
        "probability_to_miss_one_row": verification.compute_miss_probability(1),
        "robots": verification.robots,
        "teams": verification.teams,
        "new_maps": verification.new_maps,
        "new_maps_track": verification.new_map_track if verification.new_maps else None,
        "new_maps_p_value": None if comparison is None else comparison.p_value,
        "declared_message_bytes": verification.declared_bytes,
        "compressed_message_bytes": verification.compressed_bytes,
        "read_files": verification.read_files,
        "differences": differences,
    }
    print_answer(options, answer, *differences, *verification.describe(), verification.describe_verdict())
    return 0 if verification.is_successful else FAILED


def _write_page(options: Arguments) -> int:
    """Write the page that compares results."""
    from robocov.files.writing import replace_file
    from robocov_app.benchmark.page.page import build_page
    from robocov_app.benchmark.results import check_gaps, load_bundled_results, read_result
    from robocov_app.commands.report import check_target

    target = options.out or Path("benchmark.html")
    check_target(target, overwrite=False)
    results = [read_result(path) for path in options.paths]
    for path, result in zip(options.paths, results, strict=True):
        check_gaps(result, path)
    if not options.alone:
        results += load_bundled_results()
    content = build_page(results, options.title).encode("utf-8", "replace")
    with replace_file(target) as temporary:
        temporary.write_bytes(content)
    answer = {"path": str(target), "bytes": len(content), "entries": len(results)}
    print_answer(options, answer, f"written to {target} ({len(content) / 1e6:.2f} MB)")
    return 0


def _compute_references(options: Arguments) -> int:
    """Compute the missing references and bounds of the suite, and return the exit status."""
    from robocov_app.benchmark import suite
    from robocov_app.benchmark.references import compute_references
    from robocov_app.sweep.local_pool import count_processors

    target = options.out or suite.SUITE_FILE
    if target.is_dir():
        raise InputError(f"--out: {target}: expected a file for the references, got a folder")
    with Interruption() as interruption:
        known_count, missing_count = compute_references(
            target, workers=options.workers or count_processors(), quiet=options.json, stop=interruption
        )
    answer = {"path": str(target), "references_and_bounds": known_count, "left": missing_count}
    print_answer(options, answer, f"{target}: {known_count} references and bounds, {missing_count} left")
    return INTERRUPTED if missing_count else 0
