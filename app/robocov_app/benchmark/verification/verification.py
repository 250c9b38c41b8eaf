"""Verifying a result of the benchmark: runs are repeated, robots are isolated, and new maps are tried.

The process of the verification never imports the code of a user. It reads the file of the controller in order
to compute its hash, and lets other processes execute it:

=================  ==========================================  =====================================
process            executes                                    sends
=================  ==========================================  =====================================
verification       nothing of the user                         runs to referees
referee            nothing of the user: simulation, record,    observations to controllers; metrics,
(one for a run)    metrics, comparison of decisions            differences to the verification
controller (for    the code of the user, under a guard         forces, goals, messages to the
team, then for                                                 referee, as plain numbers and bytes
each robot)
=================  ==========================================  =====================================

All choices follow from a seed that the verifier draws, so that they cannot be anticipated.
"""

from __future__ import annotations

import math
import secrets
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.errors import MAX_SEED, InputError, format_count
from robocov.kernel_compilation import ALL_EXAMPLES, compile_kernels
from robocov.mapfile import to_json
from robocov_app.benchmark import suite
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.rated_controller import COVERAGE_CONTROL_FILES, ORACLE, RatedController, Selection
from robocov_app.benchmark.references import RESTARTS
from robocov_app.benchmark.result_checks import Row
from robocov_app.benchmark.results import build_row, compute_gaps, read_result
from robocov_app.benchmark.verification.controller_messages import Description, describe
from robocov_app.benchmark.verification.controller_process import (
    CACHE_PREFIX,
    ControllerFaultError,
    DescribedController,
    describe_controller,
    read_description,
)
from robocov_app.benchmark.verification.new_maps import (
    NewMap,
    NewMapComparison,
    choose_track,
    compare_gaps,
    sample_new_maps,
)
from robocov_app.benchmark.verification.referee import Referees, RepeatedRun, RunCheck
from robocov_app.evaluation.reference_search import ReferenceQuery, answer_queries
from robocov_app.sweep.ledger import describe_version_differences
from robocov_app.sweep.progress import SweepProgress, report_progress
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import EFFORT_FILE, Outcome
from robocov_app.terminal.interruption import Interruption

TrackRunKey: TypeAlias = tuple[str, str, int]
"""Track (or `NEW_MAP`), map and seed of a run."""
NEW_MAP = "new map"
"""Name in place of the track in the keys of runs on new maps."""
CHANGED_FRACTION = 0.05
"""Fraction of changed rows for which the probability of missing all of them is reported."""
_MACHINE_DEPENDENT = ("deciding_s",)
"""Metrics that differ from run to run and are not compared."""
_DESCRIBED = ("controller", "label", "information", "gains")
"""Parts of an entry that describe its controller and are compared."""
_POLL_INTERVAL_S = 0.2
"""Time between two checks for an interruption."""
_SAMPLE_STREAM = 0
"""Stream of random numbers for the choice of runs."""
_ROBOT_STREAM = 1
"""Stream of random numbers for the choice of robots, and for placeholders."""
_MAP_STREAM = 2
"""Stream of random numbers for new maps."""


@dataclass(frozen=True)
class VerificationOptions:
    """Extent of a verification.

    Attributes
    ----------
    sample : int
        Number of runs to repeat.
    robots : int
        Number of robots to isolate in each run.
    new_maps : int
        Number of new maps to draw.
    seed : int or None
        Seed of all choices; by default a random one.
    workers : int
        Maximum number of processes at the same time.
    """

    sample: int = 10
    robots: int = 2
    new_maps: int = 5
    seed: int | None = None
    workers: int = 1


@dataclass
class Verification:
    """The findings of a verification.

    Attributes
    ----------
    seed : int
        Seed of all choices, with which the verification can be repeated.
    rows : int
        Number of rows of the result.
    failed_rows : int
        Number of rows of runs that failed.
    runs : int
        Number of runs of the suite that were repeated.
    robots : int
        Number of robots whose decisions were repeated in separate processes.
    teams : int
        Number of runs in which a process received the observations of the whole team instead.
    new_maps : int
        Number of new maps that were tried.
    new_map_track : str
        Track of the runs on new maps; empty if none were planned.
    no_new_maps_reason : str
        Reason why no new maps were planned; empty if there were some.
    comparison : NewMapComparison or None
        Comparison of gaps on new maps with those on the suite.
    declared_bytes, compressed_bytes : int
        Total size of all messages in the runs, as declared and as compressed payloads.
    has_unidentified_code : bool
        Whether the controller is from an installed package, whose code the result does not identify.
    differences : list of str
        Everything that is not as expected.
    read_files : list of str
        Sorted paths of the files that the controller has read, which are not part of its source code.
    """

    seed: int
    rows: int
    failed_rows: int = 0
    runs: int = 0
    robots: int = 0
    teams: int = 0
    new_maps: int = 0
    new_map_track: str = ""
    no_new_maps_reason: str = ""
    comparison: NewMapComparison | None = None
    declared_bytes: int = 0
    compressed_bytes: int = 0
    has_unidentified_code: bool = False
    differences: list[str] = field(default_factory=list)
    read_files: list[str] = field(default_factory=list)

    def count(self, check: RunCheck, *, is_new: bool, is_joint: bool) -> None:
        """Count a checked run and its robots.

        Parameters
        ----------
        check : RunCheck
            The check of the run.
        is_new : bool
            Whether the run was on a new map.
        is_joint : bool
            Whether the robots decide together, so that none was isolated.
        """
        if is_new:
            self.new_maps += 1
        else:
            self.runs += 1
        if is_joint and check.steps:
            self.teams += 1
        self.robots += check.robots
        self.declared_bytes += check.declared_bytes
        self.compressed_bytes += check.compressed_bytes
        self.read_files = sorted({*self.read_files, *check.read_files})

    @property
    def is_successful(self) -> bool:
        """Whether at least one run was repeated, and there are no differences."""
        return self.runs > 0 and not self.differences

    def describe_verdict(self) -> str:
        """Return a sentence that says whether the result is verified, and what was left out."""
        if self.differences:
            return f"Not verified: {format_count(len(self.differences), 'difference')}."
        if not self.runs:
            return "Nothing verified: no run was repeated."
        omissions = []
        if not self.robots and not self.teams:
            omissions.append("no robot was checked")
        if not self.new_maps:
            omissions.append("new maps were not tried")
        elif self.comparison is not None and not self.comparison.is_conclusive:
            omissions.append("there were too few runs for a test on new maps")
        if not omissions:
            return "Verified: no difference."
        runs = format_count(self.runs, "run")
        return f"Verified: no difference in {runs}; {', and '.join(omissions)}."

    def compute_miss_probability(self, changed_count: int) -> float:
        """Compute the probability that none of the changed rows was among the repeated runs.

        Parameters
        ----------
        changed_count : int
            Number of changed rows.

        Examples
        --------
        >>> Verification(seed=0, rows=400, runs=4).compute_miss_probability(1)
        0.99
        """
        if changed_count + self.runs > self.rows:
            return 0.0
        return math.comb(self.rows - changed_count, self.runs) / math.comb(self.rows, self.runs)

    def describe(self) -> list[str]:
        """Return sentences that describe the checks."""
        repeated = f"{self.runs} of {format_count(self.rows, 'run')} repeated."
        if self.runs < self.rows:
            repeated += f" {self._describe_miss_probabilities()}"
        lines = [repeated]
        if self.failed_rows:
            lines.append(
                f"{self.failed_rows} of {format_count(self.rows, 'run')} "
                f"({self.failed_rows / self.rows:.0%}) failed in the result. A run that fails again is no "
                "difference: look for the reason in the code."
            )
        lines += self._describe_isolation()
        if self.comparison is not None:
            lines.append(self._describe_new_maps(self.comparison))
        elif self.no_new_maps_reason:
            lines.append(f"No new maps tried: {self.no_new_maps_reason}.")
        if self.compressed_bytes:
            lines.append(
                f"Messages: {self.declared_bytes / 1e3:,.0f} kB as the controller declares their sizes, "
                f"{self.compressed_bytes / 1e3:,.0f} kB as compressed content."
            )
        if self.has_unidentified_code:
            lines.append(
                "The controller is from an installed package. The result does not identify its code, and may "
                "have been made with another version."
            )
        if self.read_files:
            lines.append(
                "The controller has read these files, which are not part of its source code. The "
                "verification does not check their content:"
            )
            lines += [f"  {file}" for file in self.read_files]
        lines.append(f"Random choices: --seed {self.seed} repeats them.")
        return lines

    def _describe_miss_probabilities(self) -> str:
        """Return a sentence with the probabilities of missing changed rows."""
        changed_count = max(1, round(CHANGED_FRACTION * self.rows))
        one_missed = self.compute_miss_probability(1)
        text = f"A single changed row goes unnoticed with a probability of {one_missed:.1%}"
        if changed_count > 1:
            text += f", {changed_count} of them with {self.compute_miss_probability(changed_count):.1%}"
        return f"{text}."

    def _describe_isolation(self) -> Iterator[str]:
        """Yield sentences on the robots and teams whose decisions were repeated."""
        if self.robots:
            robots = format_count(self.robots, "robot")
            yield f"Decisions of {robots} repeated in processes that receive only the robot's observations."
        if self.teams:
            teams = format_count(self.teams, "team")
            yield (
                f"Decisions of {teams} repeated in processes that receive the observations of all robots, "
                "because the robots decide together: limits of communication are not checked."
            )

    def _describe_new_maps(self, comparison: NewMapComparison) -> str:
        """Return a sentence on the comparison with new maps."""
        text = (
            f"{format_count(self.new_maps, 'new map')} on the track {self.new_map_track}: median gap "
            f"{comparison.new_gap:.1%}, on the maps of the same families in the suite "
            f"{comparison.suite_gap:.1%}, p = {comparison.p_value:.2g}"
        )
        if not comparison.is_conclusive:
            text += " (too few runs in the result to show a difference)"
        return f"{text}."


def verify_result(
    path: Path,
    *,
    controller: str | None = None,
    options: VerificationOptions | None = None,
    quiet: bool = False,
    stop: Interruption,
) -> Verification:
    """Verify a result of the benchmark.

    1. The gaps of all rows are recomputed, and missing rows are found.
    2. A sample of the runs is repeated, and must give the same metrics, bit for bit
       (`robocov_app.benchmark.verification.referee`).
    3. In these runs, the decisions of some robots are repeated in separate processes that each receive only
       the observations of one robot (`robocov_app.benchmark.verification.isolation`).
    4. The controller runs on new maps, under the conditions of one of its tracks, and must not be clearly
       worse than on the maps of the suite (`robocov_app.benchmark.verification.new_maps`).

    No code to which a result refers is executed: a controller in a file must be given by the caller, and the
    hash of its source code must be that in the result.

    Parameters
    ----------
    path : Path
        A result file, or a folder that contains one.
    controller : str, optional
        The controller as ``FILE.py:CLASS``, if it is in a file of the user.
    options : VerificationOptions, optional
        Extent of the verification.
    quiet : bool
        Whether to show no progress.
    stop : Interruption
        Ends the verification early when it is requested.

    Returns
    -------
    Verification
        Without some of the findings if the user has interrupted it.

    Raises
    ------
    InputError
        If the result cannot be read, or the controller is not the rated one.
    OutputError
        If a process of the verification fails.
    """
    options = options or VerificationOptions()
    seed = secrets.randbelow(MAX_SEED) if options.seed is None else options.seed
    result = read_result(path)
    rated = _find_controller(result, path, controller)
    code = rated.read_code()
    identity = rated.identify(code.source)
    _check_source(rated, identity, result, path)
    described = _describe_controller(rated, code, stop)
    if described is None:
        return Verification(seed, rows=len(result["rows"]))
    description = described.description
    # The studies determine everything but the controller, whose code must not be executed here.
    studies = dict(rated.replace_user_code().build_studies(_get_selection(result)))
    tasks = _index_tasks(studies)
    rows = {(row["track"], row["map"], row["seed"]): row for row in result["rows"]}
    failed_count = sum("error" in row for row in rows.values())
    verification = Verification(seed, rows=len(rows), failed_rows=failed_count)
    verification.has_unidentified_code = not rated.is_built_in and code.source is None
    verification.read_files = sorted(described.read_files)
    verification.differences += [f"its controller tried {action}" for action in described.violations]
    verification.differences += _compare_descriptions(result["entry"], {**identity, **asdict(description)})
    verification.differences += _compare_without_running(rated, result, rows, tasks)

    sampled = _sample_runs(
        rows.keys() & tasks.keys(), options.sample, _create_generator(seed, _SAMPLE_STREAM)
    )
    map_rng = _create_generator(seed, _MAP_STREAM)
    new_runs = _plan_new_runs(rated, studies, options.new_maps, map_rng)
    verification.new_map_track = new_runs.track
    verification.no_new_maps_reason = new_runs.absence_reason
    chosen_tasks = {key: tasks[key] for key in sampled} | dict(new_runs.tasks)
    outcomes: dict[TrackRunKey, Outcome | None] = {}
    # A process that is killed may still write to the folder.
    with tempfile.TemporaryDirectory(prefix=CACHE_PREFIX, ignore_cleanup_errors=True) as cache_folder:
        checker = _RunChecker(
            code,
            description,
            is_joint=rated.decides_jointly,
            robots=options.robots,
            seed=seed,
            cache_folder=Path(cache_folder),
        )
        for key, check in _check_runs(checker, chosen_tasks, options.workers, quiet=quiet, stop=stop):
            verification.count(check, is_new=key in new_runs.tasks, is_joint=checker.is_joint)
            verification.differences += _list_run_differences(key, check, rows.get(key), chosen_tasks[key])
            outcomes[key] = check.outcome
    if outcomes.keys() & new_runs.tasks.keys() and not stop.requested:
        gaps = _compute_gaps_on_new_maps(new_runs, outcomes, options.workers, stop)
        verification.comparison = compare_gaps(result["rows"], gaps, new_runs.track, map_rng)
        verification.differences += _list_new_map_differences(verification.comparison)
    verification.differences = list(dict.fromkeys(verification.differences))
    return verification


def _create_generator(seed: int, *stream: int) -> np.random.Generator:
    return np.random.default_rng([seed, *stream])


def _find_controller(result: Mapping[str, Any], path: Path, controller: str | None) -> RatedController:
    """Return the controller of a result; raise InputError if it is in a file that was not given."""
    entry = result["entry"]
    name = controller or entry["controller"]
    is_file = name.rpartition(":")[0].endswith(".py")
    if controller is None and (entry["source_sha256"] or is_file):
        raise InputError(f"{path}: its controller {name} is a file; pass --controller FILE.py:CLASS")
    return RatedController(name, entry["set"])


def _get_selection(result: Mapping[str, Any]) -> Selection:
    selected = result["selection"]
    return Selection(quick=selected["quick"], tracks=tuple(selected["tracks"]), maps=tuple(selected["maps"]))


def _check_source(
    rated: RatedController, identity: Mapping[str, Any], result: Mapping[str, Any], path: Path
) -> None:
    """Raise InputError if the source code of a controller is not that of the rated one."""
    if identity["source_sha256"] != result["entry"]["source_sha256"]:
        raise InputError(
            f"{path}: --controller: {rated.controller} is not the file that was rated "
            "(or a module it imports has changed)"
        )


def _describe_controller(
    rated: RatedController, code: ControllerCode, stop: Interruption
) -> DescribedController | None:
    """Return the description of a controller; None if the user has interrupted the verification."""
    if rated.is_built_in:
        return DescribedController(read_description(describe(code)), violations=[], read_files=[])
    try:
        return describe_controller(code, lambda: stop.requested)
    except ControllerFaultError as error:
        if stop.requested:
            return None
        raise InputError(f"--controller: {error}") from None


def _compare_descriptions(entry: Mapping[str, Any], description: Mapping[str, Any]) -> list[str]:
    """List the differences between the entry of a result and the description of its controller."""
    return [
        f"entry: {name}: expected {description[name]}, got {entry[name]}"
        for name in _DESCRIBED
        if entry[name] != description[name]
    ]


def _index_tasks(studies: Mapping[str, Study]) -> dict[TrackRunKey, Task]:
    """Return the tasks of all sweeps by track, map and seed."""
    tasks = {}
    for track, study in studies.items():
        for task in generate_tasks(study):
            tasks[track, task.map, task.seed] = task
    return tasks


@dataclass(frozen=True)
class _NewRuns:
    """Runs on new maps under the conditions of one track, with their tasks by key."""

    absence_reason: str = ""
    """Reason why there are no such runs; empty if there are some."""
    track: str = ""
    maps: Sequence[NewMap] = ()
    tasks: Mapping[TrackRunKey, Task] = field(default_factory=dict)


def _plan_new_runs(
    rated: RatedController, studies: Mapping[str, Study], count: int, rng: np.random.Generator
) -> _NewRuns:
    """Sample a track of a result, and new maps of the families on this track."""
    if count == 0:
        return _NewRuns("--new-maps is 0")
    if rated.controller == ORACLE:
        return _NewRuns("the oracle needs their best placements, which are not known")
    if rated.controller in COVERAGE_CONTROL_FILES:
        return _NewRuns("no new maps are drawn on the track open-square")
    maps_by_track = {track: [study_map.name for study_map in study.maps] for track, study in studies.items()}
    track = choose_track(maps_by_track, count, rng)
    if track is None:
        return _NewRuns("none of the families in the result has new maps")
    families = dict.fromkeys(suite.FAMILY_OF[name] for name in maps_by_track[track])
    new_maps = sample_new_maps(list(families), count, rng)
    stand_in = rated.replace_user_code()
    tasks = {}
    for new_map in new_maps:
        study = stand_in.build_study(
            track, [StudyMap(new_map.name, new_map.environment)], [new_map.start_seed]
        )
        tasks[NEW_MAP, new_map.name, new_map.start_seed] = next(iter(generate_tasks(study)))
    return _NewRuns(track=track, maps=new_maps, tasks=tasks)


class _RunChecker:
    """Repeats runs, and the decisions of some of their robots in isolation.

    Parameters
    ----------
    code : ControllerCode
        The controller.
    description : Description
        What it declares about itself.
    is_joint : bool
        Whether its robots decide together, so that none can be isolated.
    robots : int
        Number of robots that are isolated in each run.
    seed : int
        Seed of the choice of robots.
    cache_folder : Path
        Folder for the machine code that the processes of controllers compile.
    """

    def __init__(
        self,
        code: ControllerCode,
        description: Description,
        *,
        is_joint: bool,
        robots: int,
        seed: int,
        cache_folder: Path,
    ) -> None:
        self.is_joint = is_joint
        self.referees = Referees()
        self._code = code
        self._description = description
        self._robots = 0 if is_joint else robots
        self._seed = seed
        self._cache_folder = cache_folder

    def check(self, key: TrackRunKey, task: Task) -> tuple[TrackRunKey, RunCheck]:
        """Repeat a run and isolate some robots; return the key and the check. Called in several threads."""
        seed = [self._seed, _ROBOT_STREAM, int(task.input_hash[:12], 16)]
        robots = np.random.default_rng(seed).permutation(task.robots)[: self._robots].tolist()
        run = RepeatedRun(
            task, self._code, self._description, sorted(robots), seed, cache_folder=self._cache_folder
        )
        return key, self.referees.repeat(run)


def _check_runs(
    checker: _RunChecker, tasks: Mapping[TrackRunKey, Task], workers: int, *, quiet: bool, stop: Interruption
) -> Iterator[tuple[TrackRunKey, RunCheck]]:
    """Check runs in parallel, and report the progress; yield each check as soon as it is finished."""
    if tasks:
        # The processes of controllers start with a copy of this machine code, and share nothing later.
        compile_kernels(ALL_EXAMPLES)
    progress = SweepProgress(len(tasks))
    with report_progress("verify", progress, quiet=quiet) as reporter:
        for key, check in _check_in_threads(checker, tasks, workers, stop):
            yield key, check
            progress.done += 1
            reporter.update(progress)


def _check_in_threads(
    checker: _RunChecker, tasks: Mapping[TrackRunKey, Task], workers: int, stop: Interruption
) -> Iterator[tuple[TrackRunKey, RunCheck]]:
    """Check runs in several threads until the user interrupts; yield each check as soon as it is finished."""
    if not tasks:
        return
    pool = ThreadPoolExecutor(min(workers, len(tasks)))
    try:
        pending = {pool.submit(checker.check, key, task) for key, task in tasks.items()}
        while pending and not stop.requested:
            done, pending = wait(pending, timeout=_POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        checker.referees.kill()
        pool.shutdown()


def _list_run_differences(key: TrackRunKey, check: RunCheck, row: Row | None, task: Task) -> list[str]:
    """List the differences found in a run: in its metrics, and in the decisions of its robots."""
    differences = [f"{_format_key(key)}: {difference}" for difference in check.differences]
    if row is not None and check.outcome is not None:
        effort = check.outcome.files.get(EFFORT_FILE, b"{}")
        differences += _compare_metrics(key, row, build_row(key[0], task, check.outcome, effort))
    return differences


def _compute_gaps_on_new_maps(
    new_runs: _NewRuns,
    outcomes: Mapping[TrackRunKey, Outcome | None],
    workers: int,
    stop: Interruption,
) -> list[tuple[str, float]]:
    """Search for the best placements on new maps, and return the family and the gap of each run.

    The gap of a run that failed or left an area uncovered is infinite. Maps without a placement, because the
    user interrupted the search, are left out.
    """
    # As in the suite, the reference is a placement of the robots that are still working at the end.
    robots = suite.TRACKS[new_runs.track].survivors
    queries = {
        new_map.name: ReferenceQuery(
            to_json(new_map.environment),
            robots,
            radius=suite.TRACKS[new_runs.track].radius,
            lattice=suite.LATTICE,
            restarts=RESTARTS,
        )
        for new_map in new_runs.maps
    }
    references = dict(answer_queries(queries, workers, stop))
    gaps = []
    for new_map in new_runs.maps:
        reference = references.get(new_map.name)
        if reference is None:
            # The search was interrupted before it reached this map.
            continue
        outcome = outcomes.get((NEW_MAP, new_map.name, new_map.start_seed))
        gap = math.inf
        if outcome is not None and outcome.error is None and not outcome.metrics["uncovered_area_m2"]:
            cost = outcome.metrics["mean_distance_m"]
            # Only failed runs have no cost.
            assert cost is not None
            gap = cost / reference.mean_distance - 1.0
        gaps.append((new_map.family, gap))
    return gaps


def _list_new_map_differences(comparison: NewMapComparison | None) -> list[str]:
    """List the difference that the controller is clearly worse on new maps, or nothing."""
    if comparison is None or not comparison.is_worse:
        return []
    return [
        f"new maps: median gap {comparison.new_gap:.1%} instead of {comparison.suite_gap:.1%} "
        f"(p = {comparison.p_value:.2g}): the controller or its gains are fitted to the maps of the suite"
    ]


def _compare_without_running(
    rated: RatedController,
    result: Mapping[str, Any],
    rows: Mapping[TrackRunKey, Row],
    tasks: Mapping[TrackRunKey, Task],
) -> Iterator[str]:
    """Yield the differences that can be found without any run: in versions, selected runs and gaps."""
    versions = describe_version_differences(result["versions"], rated.list_versions())
    if versions:
        yield f"made with {versions}"
    for key in tasks:
        if key not in rows:
            yield f"{_format_key(key)}: missing row"
    for key in rows:
        if key not in tasks:
            yield f"{_format_key(key)}: a row of a run that was not selected"
    for key, row in rows.items():
        if "error" not in row:
            yield from _compare_metrics(key, row, compute_gaps(row["track"], row["map"], row))


def _sample_runs(keys: Iterable[TrackRunKey], sample: int, rng: np.random.Generator) -> list[TrackRunKey]:
    """Return a random sample of runs, in sorted order."""
    ordered = sorted(keys)
    chosen = rng.permutation(len(ordered))[:sample].tolist()
    return [ordered[k] for k in sorted(chosen)]


def _format_key(key: TrackRunKey) -> str:
    track, map_name, seed = key
    return f"{track}, {map_name}, seed {seed}"


def _compare_metrics(key: TrackRunKey, row: Row, recomputed: Mapping[str, Any]) -> list[str]:
    """List the metrics of a row that differ from recomputed ones."""
    return [
        f"{_format_key(key)}: {name}: expected {value}, got {row.get(name)}"
        for name, value in recomputed.items()
        if name not in _MACHINE_DEPENDENT and row.get(name) != value
    ]
