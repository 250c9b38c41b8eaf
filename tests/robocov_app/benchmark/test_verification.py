"""Verification rejects cheating controllers and changed results, and accepts honest ones."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from local_deciders import run_isolated
from small_studies import HEAD, PULL, DirectExecutor

from robocov.conditions.random_streams import POSITION_STREAM, create_generator
from robocov.controllers import CONTROLLERS
from robocov.environment import Environment
from robocov.errors import InputError, NoLayoutError, ParameterError
from robocov.generator import GENERATORS
from robocov.observation import Snapshot
from robocov_app.benchmark import suite
from robocov_app.benchmark.rated_controller import LEARNED, ORACLE, RatedController, Selection
from robocov_app.benchmark.results import RESULT_FILE, compute_gaps, find_reference, read_result
from robocov_app.benchmark.running import run_benchmark
from robocov_app.benchmark.verification import verification
from robocov_app.benchmark.verification.controller_messages import decode_payload, encode_payload
from robocov_app.benchmark.verification.new_maps import (
    SIGNIFICANCE_LEVEL,
    NewMapComparison,
    choose_track,
    compare_gaps,
    sample_new_maps,
)
from robocov_app.benchmark.verification.referee import RunCheck
from robocov_app.benchmark.verification.verification import (
    Verification,
    VerificationOptions,
    verify_result,
)
from robocov_app.cli import main
from robocov_app.sweep import worker
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import perform
from robocov_app.terminal.interruption import INTERRUPTED, Interruption

MAP = "blocks-a"
TRACKS = ("ideal", "short-range", "lossy", "noisy", "unicycle", "failures")
SMALL = VerificationOptions(sample=1, robots=1, new_maps=0)
ONLY_METRICS = replace(SMALL, robots=0)

GLOBAL = """
POSITIONS = {}

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        POSITIONS[own.number] = own.position
        return sum(own.position - other for other in POSITIONS.values())
"""
"""Robots share their positions by a variable of the module."""

ON_DISK = """
FOLDER = Path(__file__).parent

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        try:
            (FOLDER / str(own.number)).write_text(str(own.position))
        except PermissionError:
            pass
        return own.centroid - own.position
"""

READER = """
from robocov_app.benchmark import suite

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        references = suite.SUITE_FILE.read_text()
        return own.centroid - own.position
"""

JOINT = """
import numpy as np
import robocov as rc

@dataclass(frozen=True)
class Mine:
    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        return rc.Decision(seen.positions.mean(axis=0) - seen.positions)
"""
"""Uses the observations of all robots, not only of those in communication range."""

WITH_MESSAGES = """
@dataclass(frozen=True)
class Mine:
    information = "shared map"

    def force(self, own):
        own.send([own.number, own.position], size=24)
        heard = [message.payload[1] for message in own.messages]
        return own.centroid - own.position + 0.1 * sum(own.position - position for position in heard)
"""

UNDECLARED_MESSAGES = WITH_MESSAGES.replace('    information = "shared map"\n', "")

FALSE_MESSAGES = """
POSITIONS = {}

@dataclass(frozen=True)
class Mine:
    information = "shared map"

    def force(self, own):
        POSITIONS[own.number] = own.position
        own.send([sum(POSITIONS.values())], size=16)
        return sum((message.payload[0] for message in own.messages), own.centroid) - own.position
"""
"""Robots send what they learn from a variable of the module; the forces follow from the messages."""

HIDDEN_DATA = """
import math

import numpy as np

READ = []

@dataclass(frozen=True)
class Mine:
    def begin(self, number, team):
        loss = -math.expm1(-team.viscosity[number] / team.mass[number] / 60)
        return loss, loss / team.viscosity[number], None

    def force(self, own):
        loss, gain, previous = own.memory
        force = 0.2 * (own.centroid - own.position)
        if previous is not None:
            velocities = 60 * (own.neighbors - previous)
            numbers = np.round(1e10 * (velocities[:, 0] - np.round(velocities[:, 0], 6))).astype(int)
            READ.append(numbers.tolist())
            force = force + 0.01 * numbers.sum()
        own.memory = loss, gain, own.neighbors
        velocity = np.round(own.velocity + gain * force - loss * own.velocity, 6)
        velocity[0] += 1e-10 * (own.number + 1)
        return (velocity - own.velocity + loss * own.velocity) / gain
"""
"""Robots with the information own hide their numbers in the last digits of their velocities."""

IMPORTS = HEAD.partition("@dataclass")[0]


@pytest.fixture(autouse=True)
def shorten_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in TRACKS:
        track = suite.TRACKS[name]
        failures = tuple((robot, 0.5) for robot, _ in track.failures)
        changed = replace(track, duration=1.5, seeds=(0,), maps=(MAP,), failures=failures)
        if name == "short-range":
            # On a small map, all robots would be in communication range at the start.
            changed = replace(changed, changes={"communication_range": 0.5})
        monkeypatch.setitem(suite.TRACKS, name, changed)  # type: ignore[arg-type]
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)


def build_task(controller: str, track: str) -> Task:
    studies = dict(RatedController(controller, {}).build_studies(Selection(tracks=(track,), maps=(MAP,))))
    return next(iter(generate_tasks(studies[track])))


def isolate(controller: str, track: str, robots: Sequence[int]) -> list[str]:
    """Return how decisions of robots differ if they get only their own observations, without processes.

    The run must have the same metrics as without isolation.
    """
    task = build_task(controller, track)
    outcome, team, _ = run_isolated(task, robots)
    assert outcome.error is None
    assert outcome.metrics == perform(task).metrics
    return team.differences


SLOW = ("atlas", "adaptive", "boosting", "visibility", "geodesic-lloyd", "diffeomorphism", "barrier")
ISOLATED = [
    pytest.param(name, track, id=f"{name}-{track}", marks=[pytest.mark.slow] if name in SLOW else [])
    for name, kind in CONTROLLERS.items()
    for track in TRACKS
    if kind.information != "shared map"
]


@pytest.mark.parametrize(("controller", "track"), ISOLATED)
def test_robots_of_built_in_controllers_decide_by_their_own_observations(controller: str, track: str) -> None:
    assert isolate(controller, track, [2]) == []


@pytest.mark.parametrize("track", TRACKS)
def test_robots_of_the_learned_controller_decide_by_their_own_observations(track: str) -> None:
    assert isolate(LEARNED, track, [2]) == []


QUICK_SHARED_RUN = ("greedy-submodular", "lossy")
SIMILAR_CONTROLLERS = ("frontier-median", "voronoi-graph")
"""Controllers that share maps by the same code as `greedy-submodular`, which runs on all tracks."""
DISTURBED_TRACKS = ("short-range", "lossy", "noisy")
"""Tracks on which these controllers run: with missing messages, or inexact positions."""
SHARED_RUNS = [
    pytest.param(
        name,
        track,
        id=f"{name}-{track}",
        marks=[] if (name, track) == QUICK_SHARED_RUN else [pytest.mark.slow],
    )
    for name, kind in CONTROLLERS.items()
    for track in (DISTURBED_TRACKS if name in SIMILAR_CONTROLLERS else TRACKS)
    if kind.information == "shared map"
]


@pytest.mark.parametrize(("controller", "track"), SHARED_RUNS)
def test_robots_that_share_maps_decide_by_their_own_observations(
    controller: str, track: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within 4 s, robots receive scans and make at least two plans with them."""
    longer = replace(suite.TRACKS[track], duration=4.0)
    monkeypatch.setitem(suite.TRACKS, track, longer)  # type: ignore[arg-type]
    snapshots: list[Snapshot] = []
    outcome, team, _ = run_isolated(build_task(controller, track), [2, 3], snapshots)
    assert outcome.error is None
    # Robots of gp-ucb have nothing to send if they know that the density is the same everywhere. The test of
    # robots that learn a density from delivered messages only is about their messages.
    assert any(any(snapshot.seen.messages) for snapshot in snapshots) == (controller != "gp-ucb")
    assert team.differences == []
    # Compressed payloads contain names of classes, which outweigh the few measurements of the first seconds.
    assert team.compressed_bytes <= 11 * team.declared_bytes
    assert outcome.metrics == perform(build_task(controller, track)).metrics


@pytest.mark.slow
def test_robots_of_the_oracle_decide_by_the_observations_of_the_team() -> None:
    assert isolate(ORACLE, "short-range", []) == []


def test_observations_of_others_are_hidden_from_an_isolated_robot() -> None:
    snapshots: list[Snapshot] = []
    _, team, deciders = run_isolated(build_task("atlas", "short-range"), [2], snapshots)
    assert team.differences == []
    for snapshot, hidden in zip(snapshots, deciders[2].received, strict=True):
        seen = snapshot.seen
        neighbors = seen.neighbors.list_neighbors(2)
        strangers = np.setdiff1d(np.arange(6), [2, *neighbors])
        assert (hidden.positions[neighbors] == seen.positions[neighbors]).all()
        assert (hidden.positions[strangers] != seen.positions[strangers]).all()
        others = np.arange(6) != 2
        assert (hidden.velocities[others] == 0.0).all()
        assert np.isnan(hidden.obstacle_points[others]).all()
        assert (hidden.velocities[2] == seen.velocities[2]).all()
        if seen.scans is not None:
            assert hidden.scans is not None and (hidden.scans.distances[others] == 0.0).all()
        assert hidden.neighbors.list_neighbors(2).tolist() == neighbors.tolist()
        assert not any(len(hidden.neighbors.list_neighbors(stranger)) for stranger in strangers)


@pytest.mark.parametrize("code", [GLOBAL, JOINT], ids=["module variable", "all rows"])
def test_hidden_knowledge_changes_the_decisions_of_an_isolated_robot(code: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(IMPORTS + code)
    (difference,) = isolate(f"{tmp_path / 'mine.py'}:Mine", "short-range", [2])
    assert "robot 3 decides differently from" in difference
    assert difference.endswith("if its process receives only its own observations")


def test_data_hidden_in_motion_is_not_detected(tmp_path: Path) -> None:
    """The handbook names this limit of verifications."""
    (tmp_path / "mine.py").write_text(IMPORTS + HIDDEN_DATA)
    _, team, deciders = run_isolated(build_task(f"{tmp_path / 'mine.py'}:Mine", "ideal"), [2])
    assert team.differences == []
    controller: Any = deciders[2]._program._caller.controller
    read = controller.controller.force.__globals__["READ"]
    # Robot 3 reads the numbers of the others.
    assert read[-1] == [1, 2, 4, 5, 6]


def test_the_noise_of_frozen_runs_can_be_computed() -> None:
    """The handbook names this limit of verifications."""
    snapshots: list[Snapshot] = []
    task = build_task("lloyd", "noisy")
    run_isolated(task, [], snapshots)
    noise = create_generator(task.seed, POSITION_STREAM, 0).normal(scale=0.1, size=(6, 2))
    quiet_snapshots: list[Snapshot] = []
    run_isolated(build_task("lloyd", "ideal"), [], quiet_snapshots)
    computed = snapshots[0].seen.positions - noise
    assert computed == pytest.approx(quiet_snapshots[0].seen.positions, abs=1e-12)


@pytest.mark.parametrize("track", ["ideal", "short-range", "lossy"])
def test_robots_may_send_messages(track: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(IMPORTS + WITH_MESSAGES)
    assert isolate(f"{tmp_path / 'mine.py'}:Mine", track, [2]) == []


def test_messages_with_hidden_knowledge_are_detected(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(IMPORTS + FALSE_MESSAGES)
    (difference,) = isolate(f"{tmp_path / 'mine.py'}:Mine", "short-range", [2])
    assert "decides differently" in difference


def test_messages_that_are_larger_than_declared_are_shown(tmp_path: Path) -> None:
    code = WITH_MESSAGES.replace("size=24", "size=1").replace(
        "own.position]", "own.position, os.urandom(9000)]"
    )
    (tmp_path / "mine.py").write_text(IMPORTS + code)
    _, team, _ = run_isolated(build_task(f"{tmp_path / 'mine.py'}:Mine", "lossy"), [])
    # Within 1.5 s, six robots decide 91 times.
    assert team.declared_bytes == 6 * 91
    assert team.compressed_bytes > 6 * 91 * 9000
    verification = Verification(seed=0, rows=1)
    check = RunCheck(outcome=None, robots=0, differences=[], declared_bytes=540, compressed_bytes=4_900_000)
    verification.count(check, is_new=False, is_joint=False)
    expected = "Messages: 1 kB as the controller declares their sizes, 4,900 kB as compressed content."
    assert expected in verification.describe()


def test_messages_that_are_not_declared_are_reported(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(IMPORTS + UNDECLARED_MESSAGES)
    assert isolate(f"{tmp_path / 'mine.py'}:Mine", "ideal", [2]) == [
        'robots send messages from 0.00 s on, but declare the information "own"'
    ]
    with pytest.raises(InputError, match="A controller whose robots send messages must declare"):
        rate(tmp_path, UNDECLARED_MESSAGES, "ideal")


def test_equal_payloads_have_equal_bytes() -> None:
    shared = np.arange(3.0)
    read_only = np.arange(3.0)
    read_only.setflags(write=False)
    payload = {"a": [shared, shared], "b": "x"}
    assert encode_payload(payload) == encode_payload({"a": [np.arange(3.0), read_only], "b": "x"})
    assert encode_payload([0.0]) != encode_payload([-0.0])
    assert encode_payload([1]) != encode_payload([1.0])
    np.testing.assert_equal(decode_payload(encode_payload(payload)), payload)


def rate(folder: Path, code: str, track: str) -> tuple[Path, str]:
    """Write a controller and rate it; return the folder of its result, and its name."""
    (folder / "mine.py").write_text(IMPORTS + code)
    name = f"{folder / 'mine.py'}:Mine"
    with Interruption() as stop:
        selection = Selection(tracks=(track,), maps=(MAP,))
        run_benchmark(RatedController(name, {}), selection, folder / "out", stop=stop, workers=1, quiet=True)
    return folder / "out", name


def verify(folder: Path, name: str, options: VerificationOptions = SMALL) -> Verification:
    with Interruption() as stop:
        return verify_result(folder, controller=name, options=options, stop=stop, quiet=True)


@pytest.mark.parametrize(
    ("code", "track", "expected"),
    [
        (HEAD.removeprefix(IMPORTS) + PULL, "ideal", None),
        (GLOBAL, "short-range", "decides differently"),
        (ON_DISK, "ideal", "its controller tried writing"),
        (READER, "ideal", "its controller tried reading"),
    ],
    ids=["honest", "module variable", "disk", "references"],
)
def test_only_honest_controllers_are_verified(
    code: str, track: str, expected: str | None, tmp_path: Path
) -> None:
    folder, name = rate(tmp_path, code, track)
    verification = verify(folder, name)
    assert verification.runs == 1
    if expected is None:
        assert verification.differences == []
        assert verification.robots == 1
    else:
        assert any(expected in difference for difference in verification.differences)


STACK = """
import sys

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        frame = sys._getframe()
        while frame is not None:
            for value in frame.f_locals.values():
                if type(value).__name__ == "Simulation":
                    return value.positions.mean(axis=0) - own.position
            frame = frame.f_back
        return own.centroid - own.position
"""
"""Robots look for the simulation on the stack."""

OBJECTS = """
import gc

def find_secrets():
    for value in gc.get_objects():
        kind = type(value).__name__
        if kind in ("Simulation", "Task"):
            return True
        # Examples with which robocov compiles functions have fewer obstacles.
        if kind == "Environment" and len(getattr(value, "obstacles", ())) > 2:
            return True
        if kind == "Observations" and value.time > 0.0:
            return True
    return False

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        if own.time == 0.0 and find_secrets():
            return [5.0, 0.0]
        return own.centroid - own.position
"""
"""Robots look for the simulation, the map, and observations of later steps among all objects."""

EXECUTED_AS_COMPILER = """
from robocov.compiled import import_numba
numba = import_numba()
CODE = "def write(path):\\n    open(path, 'w').close()"

def write_as(name, file):
    namespace = {"__name__": name}
    exec(compile(CODE, file, "exec"), namespace)
    try:
        namespace["write"](FILE)
    except PermissionError:
        pass

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        write_as("numba.x", "numba/x.py")
        write_as("numba", numba.__file__)
        return own.centroid - own.position
"""
"""Writes with code that pretends to belong to a compiler, by the names of its module and file."""


@pytest.mark.parametrize("code", [STACK, OBJECTS], ids=["stack", "objects"])
def test_a_controller_finds_nothing_in_its_process(code: str, tmp_path: Path) -> None:
    folder, name = rate(tmp_path, code, "ideal")
    verification = verify(folder, name, ONLY_METRICS)
    assert any("path_length_m: expected" in difference for difference in verification.differences)


def test_code_is_recognized_by_its_file_and_not_by_its_name(tmp_path: Path) -> None:
    target = tmp_path / "written"
    folder, name = rate(tmp_path, f"FILE = {str(target)!r}" + EXECUTED_AS_COMPILER, "ideal")
    target.unlink()
    verification = verify(folder, name, ONLY_METRICS)
    assert f"ideal, {MAP}, seed 0: its controller tried writing {target}" in verification.differences
    assert not target.exists()


COMPILED = """
from robocov.compiled import import_numba

@import_numba().njit(cache=True)
def subtract(first, second):
    return first - second

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        return subtract(own.centroid, own.position)
"""


@pytest.mark.slow
def test_compilers_may_write_files(tmp_path: Path) -> None:
    folder, name = rate(tmp_path, COMPILED, "ideal")
    verification = verify(folder, name, ONLY_METRICS)
    assert verification.differences == []


@pytest.mark.parametrize(
    "attack",
    [
        """
import robocov_app.sweep.worker as worker
select_metrics = worker._select_metrics
worker._select_metrics = lambda summary: {**select_metrics(summary), "contacts": 0, "mean_distance_m": COST}
""",
        """
from robocov_app.benchmark.verification import verification
verification._compare_metrics = lambda *_: []
""",
        """
import robocov_app.benchmark.verification.controller_program as program
COMMAND = "import robocov_app.sweep.worker as worker; worker._select_metrics = lambda _: {}"

class Command:
    def __reduce__(self):
        return exec, (COMMAND,)

program.encode_decision = lambda _: Command()
""",
    ],
    ids=["metrics", "verifier", "pickle"],
)
def test_code_of_a_controller_changes_nothing_outside_its_process(attack: str, tmp_path: Path) -> None:
    """The result has a better cost than the controller, which tries to hide this in several ways."""
    honest_code = HEAD.removeprefix(IMPORTS) + PULL
    folder, name = rate(tmp_path, honest_code, "ideal")
    result = read_result(folder)
    row = result["rows"][0]
    row["mean_distance_m"] *= 0.99
    row |= compute_gaps(row["track"], row["map"], row)
    attack = attack.replace("COST", str(row["mean_distance_m"]))
    (tmp_path / "mine.py").write_text(IMPORTS + honest_code + attack)
    rated = RatedController(name, {})
    result["entry"]["source_sha256"] = rated.identify(rated.read_code().source)["source_sha256"]
    (folder / RESULT_FILE).write_text(json.dumps(result))
    honest_functions = worker._select_metrics, verification._compare_metrics
    differences = verify(folder, name, ONLY_METRICS).differences
    assert (worker._select_metrics, verification._compare_metrics) == honest_functions
    expected = "mean_distance_m: expected"
    if "Command" in attack:
        expected = "its process sent an invalid message: builtins.exec: expected plain values"
    assert any(expected in difference for difference in differences)


READS_FILE = """
@dataclass(frozen=True)
class Mine:
    def force(self, own):
        pull = float(Path(FILE).read_text())
        return pull * (own.centroid - own.position)
"""


@pytest.mark.slow
def test_files_that_a_controller_reads_are_reported(tmp_path: Path) -> None:
    weights = tmp_path / "weights.txt"
    weights.write_text("0.5")
    folder, name = rate(tmp_path, f"FILE = {str(weights)!r}" + READS_FILE, "ideal")
    verification = verify(folder, name)
    assert verification.differences == []
    assert verification.read_files == [str(weights)]
    assert f"  {weights}" in verification.describe()


ON_UNKNOWN_MAPS = """
@dataclass(frozen=True)
class Mine:
    def force(self, own):
        return [0.0, 0.0]
"""
"""Robots stay at rest, as with a controller that works only on maps of the suite."""


@pytest.mark.slow
def test_a_controller_that_knows_the_suite_is_not_verified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Better references would change the gaps on new maps only a little.
    monkeypatch.setattr(verification, "RESTARTS", 2)
    folder, name = rate(tmp_path, ON_UNKNOWN_MAPS, "ideal")
    names = [name for kind in ("polygons", "blocks", "homes", "plants") for name in suite.FAMILIES[kind]]
    track = replace(suite.TRACKS["ideal"], maps=tuple(names))
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]
    result = json.loads((folder / RESULT_FILE).read_text())
    # On the maps of the suite, it ends at the best placements that are known.
    row = result["rows"][0]
    result["selection"] = {"quick": False, "tracks": ["ideal"], "maps": []}
    result["rows"] = []
    for map_name in names:
        cost = find_reference(map_name, 6)["mean_distance_m"]
        placed = {**row, "map": map_name, "mean_distance_m": cost}
        result["rows"].append({**placed, **compute_gaps("ideal", map_name, placed)})
    (folder / RESULT_FILE).write_text(json.dumps(result))
    verified = verify(folder, name, VerificationOptions(sample=0, robots=0, new_maps=4, workers=2))
    assert verified.comparison is not None and verified.comparison.suite_gap == 0.0
    assert verified.new_map_track == "ideal"
    (difference,) = verified.differences
    assert difference.endswith("the controller or its gains are fitted to the maps of the suite")


def test_an_entry_with_other_information_is_not_verified(tmp_path: Path) -> None:
    folder, name = rate(tmp_path, HEAD.removeprefix(IMPORTS) + PULL, "ideal")
    result = json.loads((folder / RESULT_FILE).read_text())
    result["entry"]["information"] = "whole map"
    (folder / RESULT_FILE).write_text(json.dumps(result))
    verification = verify(folder, name, VerificationOptions(sample=0, robots=0, new_maps=0))
    assert verification.differences == ["entry: information: expected own, got whole map"]


def test_seeds_are_drawn_unless_one_is_given(tmp_path: Path) -> None:
    folder, name = rate(tmp_path, HEAD.removeprefix(IMPORTS) + PULL, "ideal")
    nothing = VerificationOptions(sample=0, robots=0, new_maps=0)
    first = verify(folder, name, nothing)
    second = verify(folder, name, nothing)
    assert first.seed != second.seed
    assert verify(folder, name, replace(nothing, seed=7)).seed == 7


def test_the_probability_to_miss_changed_rows_agrees_with_sampling() -> None:
    verification = Verification(seed=0, rows=10, runs=3)
    rng = np.random.default_rng(0)
    missed = [not {0, 1} & set(rng.permutation(10)[:3].tolist()) for _ in range(4000)]
    assert verification.compute_miss_probability(2) == pytest.approx(np.mean(missed), abs=0.03)
    assert replace(verification, runs=10).compute_miss_probability(1) == 0.0


def test_the_probability_to_miss_changed_rows_is_omitted_if_all_runs_are_repeated() -> None:
    some = Verification(seed=0, rows=10, runs=3)
    assert "goes unnoticed with a probability of 70.0%" in some.describe()[0]
    assert replace(some, runs=10).describe()[0] == "10 of 10 runs repeated."


def test_a_result_is_verified_only_if_runs_were_repeated() -> None:
    nothing = Verification(seed=0, rows=10, new_maps=5, robots=10)
    assert nothing.describe_verdict() == "Nothing verified: no run was repeated."
    assert not nothing.is_successful
    differing = replace(nothing, runs=2, differences=["a difference"])
    assert differing.describe_verdict() == "Not verified: 1 difference."
    assert not differing.is_successful
    complete = replace(nothing, runs=2)
    assert complete.describe_verdict() == "Verified: no difference."
    assert complete.is_successful
    inconclusive = replace(complete, comparison=NewMapComparison(0.0, 0.0, 0.5, min_p_value=0.01))
    assert inconclusive.describe_verdict() == (
        "Verified: no difference in 2 runs; there were too few runs for a test on new maps."
    )
    short = replace(complete, robots=0, new_maps=0)
    assert short.describe_verdict() == (
        "Verified: no difference in 2 runs; no robot was checked, and new maps were not tried."
    )


def test_the_number_of_failed_runs_is_reported() -> None:
    some = Verification(seed=0, rows=10, failed_rows=4, runs=3)
    assert some.describe()[1].startswith("4 of 10 runs (40%) failed in the result.")
    assert not any("failed" in line for line in replace(some, failed_rows=0).describe())


def test_unidentified_code_of_an_installed_package_is_reported() -> None:
    some = Verification(seed=0, rows=10, runs=3)
    assert not any("installed package" in line for line in some.describe())
    unidentified = replace(some, has_unidentified_code=True)
    assert any("The controller is from an installed package." in line for line in unidentified.describe())


def build_rows(gap: float, spread: float = 0.0) -> list[dict[str, Any]]:
    rng = np.random.default_rng(0)
    names = [name for names in suite.FAMILIES.values() for name in names]
    return [
        {"track": "ideal", "map": name, "seed": seed, "gap": gap + spread * rng.random()}
        for name, seed in product(names, (0, 1))
    ]


@pytest.fixture
def whole_track(monkeypatch: pytest.MonkeyPatch) -> None:
    maps = tuple(name for names in suite.FAMILIES.values() for name in names)
    monkeypatch.setitem(suite.TRACKS, "ideal", replace(suite.TRACKS["ideal"], maps=maps))  # type: ignore[arg-type]


def compare(rows: list[dict[str, Any]], new_gaps: list[tuple[str, float]]) -> NewMapComparison | None:
    return compare_gaps(rows, new_gaps, "ideal", np.random.default_rng(0))


@pytest.mark.usefixtures("whole_track")
def test_a_larger_gap_on_new_maps_is_detected() -> None:
    families = list(GENERATORS)
    known = compare(build_rows(0.0, 0.001), [(family, 0.02) for family in families])
    assert known is not None and known.is_worse
    assert known.new_gap == 0.02
    failed = compare(build_rows(0.1, 0.1), [(family, math.inf) for family in families])
    assert failed is not None and failed.is_worse
    equal = compare(build_rows(0.1, 0.1), [(family, 0.15) for family in families])
    assert equal is not None and not equal.is_worse


@pytest.mark.usefixtures("whole_track")
def test_equal_gaps_on_new_maps_are_accepted() -> None:
    rng = np.random.default_rng(1)
    p_values = []
    for _ in range(60):
        comparison = compare(build_rows(0.0, 1.0), [(family, float(rng.random())) for family in GENERATORS])
        assert comparison is not None
        p_values.append(comparison.p_value)
    assert min(p_values) > SIGNIFICANCE_LEVEL
    assert 0.2 < np.median(p_values) < 0.8


def test_a_few_rows_are_not_enough_for_a_significant_difference() -> None:
    rows = [{"track": "ideal", "map": MAP, "seed": 0, "gap": 0.0}]
    assert compare(rows, [("polygons", 0.5)]) is None
    comparison = compare(rows, [("bundled", 0.5)])
    assert comparison is not None
    assert comparison.min_p_value == 0.5
    assert not comparison.is_worse and not comparison.is_conclusive


def test_p_values_are_the_probabilities_of_ranks() -> None:
    """Two families with two maps each: of nine pairs of ranks, three have a sum of at most 1 + 2."""
    rows = [
        {"track": "lossy", "map": f"{family}-{seed}", "seed": 0, "gap": 0.1 * (seed - 7000)}
        for family in ("blocks", "rooms")
        for seed in (7001, 7002)
    ]
    # The first gap is the largest of three, the second one is in the middle.
    comparison = compare_gaps(rows, [("blocks", 0.3), ("rooms", 0.15)], "lossy", np.random.default_rng(0))
    assert comparison is not None
    assert comparison.p_value == pytest.approx(3 / 9)
    assert comparison.min_p_value == pytest.approx(1 / 9)


@pytest.mark.parametrize(
    ("known_gaps", "unknown_gaps", "case_count"), [([0.0], [1.0, 2.0], 3**5), ([0.0, 0.0], [1.0], 2**5)]
)
def test_most_controllers_that_know_some_of_the_maps_are_not_detected(
    known_gaps: list[float], unknown_gaps: list[float], case_count: int
) -> None:
    """The page "benchmark" of the handbook names this limit in its section on new maps."""
    families = ("blocks", "rooms", "polygons", "mazes", "caves")
    rows = []
    for family in families:
        for number, gap in enumerate(known_gaps + unknown_gaps, start=7001):
            rows.append({"track": "lossy", "map": f"{family}-{number}", "seed": 0, "gap": gap})
    # On a new map, all ranks among the gaps on the unknown maps are equally likely.
    possible_gaps = [gap + 0.5 for gap in (0.0, *unknown_gaps)]
    detected = []
    for gaps in product(possible_gaps, repeat=len(families)):
        new_gaps = list(zip(families, gaps, strict=True))
        comparison = compare_gaps(rows, new_gaps, "lossy", np.random.default_rng(0))
        assert comparison is not None
        detected.append(comparison.is_worse)
    assert len(detected) == case_count
    assert sum(detected) == 1


def test_the_gap_on_a_map_is_that_of_a_single_run() -> None:
    """The mean of several runs would vary less than the gap on a new map, where there is only one run."""
    rows = [{"track": "ideal", "map": "blocks-7001", "seed": seed, "gap": float(seed)} for seed in (0, 1)]
    gaps = set()
    for seed in range(20):
        comparison = compare_gaps(rows, [("blocks", 0.5)], "ideal", np.random.default_rng(seed))
        assert comparison is not None
        gaps.add(comparison.suite_gap)
    assert gaps == {0.0, 1.0}


@pytest.mark.usefixtures("whole_track")
def test_the_track_of_new_maps_is_drawn_from_those_that_can_show_a_difference() -> None:
    core = [name for names in suite.FAMILIES.values() for name in names[:3]]
    maps_by_track = {
        "ideal": suite.TRACKS["ideal"].maps,
        "short-range": core,
        "noisy": core[:18],
        "density": suite.TRACKS["density"].maps,
    }

    def choose(tracks: Sequence[str], count: int) -> set[str | None]:
        chosen = {name: maps_by_track[name] for name in tracks}
        return {choose_track(chosen, count, np.random.default_rng(seed)) for seed in range(20)}

    # Five maps of families with three maps each are just enough.
    assert choose(list(maps_by_track), 5) == {"ideal", "short-range", "noisy"}
    assert choose(list(maps_by_track), 4) == {"ideal"}
    assert choose(["short-range", "density"], 1) == {"short-range"}
    assert choose(["density"], 5) == {None}


def test_new_maps_are_of_different_families_and_not_in_the_suite() -> None:
    new_maps = sample_new_maps(list(suite.FAMILIES), 4, np.random.default_rng(3))
    assert len({new_map.family for new_map in new_maps}) == 4
    hashes = {frozen["sha256"] for frozen in suite.load_frozen_maps().values()}
    for new_map in new_maps:
        assert new_map.name not in suite.FAMILY_OF
        assert suite.compute_map_hash(new_map.environment) not in hashes
        assert len(new_map.environment.start().sample(6, seed=new_map.start_seed)) == 6


def test_a_family_without_suitable_seeds_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def find_no_layout(family: str, seed: int) -> Environment:
        raise NoLayoutError(f"map {family}-{seed}: no random plan is suitable")

    monkeypatch.setattr(suite, "build_family_map", find_no_layout)
    message = "--new-maps: none of 100 seeds gives a map of the family caves"
    with pytest.raises(ParameterError, match=f"^{message}$"):
        sample_new_maps(["caves"], 1, np.random.default_rng(3))


@pytest.mark.parametrize(
    ("options", "answer"),
    [
        ([], "Interrupted. The result was not verified.\n"),
        (["--json"], '{"path": "mine", "interrupted": true}\n'),
    ],
)
def test_an_interrupted_verification_is_reported(
    options: list[str], answer: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(path: Path, *, stop: Interruption, **_: object) -> None:
        stop.requested = True

    monkeypatch.setattr(verification, "verify_result", interrupt)
    assert main(["benchmark", "verify", "mine", *options]) == INTERRUPTED
    assert capsys.readouterr().out == answer
