"""Processes of controllers cannot disrupt or evade a verification by what they send, read or withhold."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from local_deciders import LocalDecider
from small_studies import HEAD

from robocov_app.benchmark import suite
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.rated_controller import ORACLE, RatedController, Selection
from robocov_app.benchmark.verification import controller_process, referee, verification
from robocov_app.benchmark.verification.controller_messages import (
    MAX_TEXT_CHARS,
    DamagedMessageError,
    Description,
    Setup,
    decode_decision,
)
from robocov_app.benchmark.verification.controller_process import (
    MAX_READ_FILES,
    ControllerFaultError,
    ControllerProcess,
    describe_controller,
    read_description,
)
from robocov_app.benchmark.verification.referee import RefereeService, RepeatedRun, RunCheck
from robocov_app.benchmark.verification.verification import Verification
from robocov_app.jobs.messages import Channel
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.terminal.interruption import Interruption

CODE = ControllerCode("lloyd", {}, None)
SENDER = """
import pickle
import sys

sys.set_int_max_str_digits(0)
NESTED = b"(" * 200_000 + b"t" * 200_000
sys.stdout.buffer.write({message})
"""
"""Program that sends a message and ends."""
ENDLESS = "while True: pass"
IMPORTS = HEAD.partition("@dataclass")[0]
READER = """
FOLDER = Path(__file__).parent

@dataclass(frozen=True)
class Mine:
    for number in range(COUNT):
        (FOLDER / f"weights-{number:02}").read_bytes()

    def force(self, own):
        return own.centroid - own.position
"""


def load_code(folder: Path, code: str) -> tuple[RatedController, ControllerCode]:
    (folder / "mine.py").write_text(IMPORTS + code)
    rated = RatedController(f"{folder / 'mine.py'}:Mine", {})
    return rated, rated.read_code()


def read_while_described(folder: Path, count: int) -> controller_process.DescribedController:
    for number in range(count):
        (folder / f"weights-{number:02}").touch()
    return describe_controller(load_code(folder, READER.replace("COUNT", str(count)))[1])


def test_files_that_are_read_by_a_description_are_returned(tmp_path: Path) -> None:
    described = read_while_described(tmp_path, 3)
    assert described.read_files == [str(tmp_path / f"weights-0{number}") for number in range(3)]
    assert described.violations == []


def test_reading_many_files_is_a_violation(tmp_path: Path) -> None:
    described = read_while_described(tmp_path, MAX_READ_FILES + 2)
    assert len(described.read_files) == MAX_READ_FILES
    assert described.violations == ["reading more than 20 files that are not part of its source code"]


def test_all_files_that_were_read_are_listed() -> None:
    some = Verification(seed=0, rows=1)
    for files in (["/c", "/a"], ["/b", "/a"]):
        check = RunCheck(outcome=None, robots=0, differences=[], read_files=files)
        some.count(check, is_new=False, is_joint=False)
    lines = some.describe()
    first = lines.index("  /a")
    assert lines[first - 1].startswith("The controller has read these files,")
    assert lines[first : first + 3] == ["  /a", "  /b", "  /c"]


@pytest.mark.parametrize(
    "message",
    [
        "pickle.dumps(('fault', 10**5000))",
        "pickle.dumps(('fault', 'a', 'b'))",
        "pickle.dumps(('violation', 'x' * 5000))",
        "pickle.dumps(('reading', b'path'))",
        "pickle.dumps((10**5000, 1))",
        "pickle.dumps(10**5000)",
        "b'(S\"fault\"\\n' + NESTED + b't.'",
        "b'(S\"violation\"\\n' + NESTED + b't.'",
        "b'(' + NESTED + b't.'",
        "pickle.dumps(('answer', {'label': 10**5000}))",
        "b'(S\"answer\"\\n' + NESTED + b't.'",
    ],
)
def test_messages_of_other_values_are_faults(
    message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controller_process, "_PROGRAM", SENDER.replace("{message}", message))
    with (
        ControllerProcess(tmp_path) as process,
        pytest.raises(ControllerFaultError, match="its process sent an invalid"),
    ):
        process.describe(CODE)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("label", 10**5000),
        ("label", "x" * (MAX_TEXT_CHARS + 1)),
        ("information", 10**5000),
        ("gains", [1.0]),
        ("gains", {1: 1.0}),
        ("gains", {"k": 10**5000}),
        ("gains", {"k": math.nan}),
        ("gains", {"k": [1.0]}),
        ("scanning", (10**5000, 1.0)),
        ("scanning", 1),
    ],
    # Python does not convert the largest of these numbers to text.
    ids=map(str, range(10)),
)
def test_descriptions_of_other_values_are_faults(key: str, value: Any) -> None:
    gains = {"k": 1.0, "mode": "a", "limit": None}
    values = {"label": "Mine", "information": "own", "gains": gains, "scanning": None}
    assert read_description(values).label == "Mine"
    with pytest.raises(ControllerFaultError, match="its process sent an invalid description"):
        read_description({**values, key: value})


@pytest.mark.parametrize("messages", [[[]], [[], [], []], {}, "ab"])
def test_decisions_without_messages_of_each_robot_are_rejected(messages: Any) -> None:
    rows = np.zeros((2, 2)).tobytes()
    assert decode_decision((rows, None, [[], []]), 2).messages == [[], []]
    with pytest.raises(DamagedMessageError, match="expected a list of messages for each of 2 robots"):
        decode_decision((rows, None, messages), 2)


def test_a_process_that_does_not_answer_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(controller_process, "_PROGRAM", ENDLESS)
    monkeypatch.setattr(controller_process, "DESCRIPTION_LIMIT_S", 0.3)
    with (
        ControllerProcess(tmp_path) as process,
        pytest.raises(ControllerFaultError, match=r"its process did not answer within 0\.3 s"),
    ):
        process.describe(CODE)


def test_an_interruption_ends_a_description(tmp_path: Path) -> None:
    rated, code = load_code(tmp_path, f"class Mine:\n    {ENDLESS}\n")
    stop = Interruption()
    stop.requested = True
    start = time.monotonic()
    assert verification._describe_controller(rated, code, stop) is None
    assert time.monotonic() - start < controller_process.DESCRIPTION_LIMIT_S


class LocalProcess(LocalDecider):
    """Replaces a `ControllerProcess`, and logs when it starts, decides and ends."""

    log: list[str]
    is_faulty = False

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.violations: list[str] = []
        self.read_files: list[str] = []
        self._name = ""

    def __enter__(self) -> LocalProcess:
        return self

    def __exit__(self, *exception: object) -> None:
        self.log.append(f"{self._name} ends")

    def begin(self, setup: Setup) -> None:
        self._name = "team" if setup.robot is None else f"robot {setup.robot + 1}"
        self.log.append(f"{self._name} starts")
        if self.is_faulty:
            raise ControllerFaultError("a fault")
        super().begin(setup)


@pytest.fixture
def process_log(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    log: list[str] = []
    monkeypatch.setattr(LocalProcess, "log", log, raising=False)
    monkeypatch.setattr(referee, "ControllerProcess", LocalProcess)
    track = replace(suite.TRACKS["ideal"], duration=0.1, seeds=(0,), maps=("blocks-a",))
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]
    return log


def check_run(folder: Path) -> RunCheck:
    studies = dict(
        RatedController("lloyd", {}).build_studies(Selection(tracks=("ideal",), maps=("blocks-a",)))
    )
    task = next(iter(generate_tasks(studies["ideal"])))
    description = Description("Lloyd", "own", {}, None)
    run = RepeatedRun(task, CODE, description, robots=[1, 3], seed=[0], cache_folder=folder)
    return RefereeService()([run], Channel())


def test_only_one_process_of_a_controller_exists_at_a_time(process_log: list[str], tmp_path: Path) -> None:
    """Otherwise, each process could measure how long the others take, which could reveal what they know."""
    check = check_run(tmp_path)
    names = ("team", "robot 2", "robot 4")
    assert process_log == [f"{name} {event}" for name in names for event in ("starts", "ends")]
    assert check.differences == []
    assert check.robots == 2
    # In 0.1 s, robots decide seven times.
    assert check.steps == 7


def test_robots_of_a_run_without_decisions_are_not_counted(
    process_log: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LocalProcess, "is_faulty", True)
    check = check_run(tmp_path)
    assert process_log == ["team starts", "team ends"]
    assert check.outcome is not None and check.outcome.error == "a fault"
    assert (check.robots, check.steps) == (0, 0)
    some = Verification(seed=0, rows=1)
    some.count(check, is_new=False, is_joint=True)
    assert some.teams == 0
    some.count(replace(check, steps=1), is_new=False, is_joint=True)
    assert some.teams == 1


@pytest.mark.parametrize(
    ("controller", "count", "expected"),
    [
        ("lloyd", 0, "--new-maps is 0"),
        (ORACLE, 5, "the oracle needs their best placements"),
        ("coverage-control-centralized", 5, "no new maps are drawn on the track open-square"),
        ("lloyd", 5, "none of the families in the result has new maps"),
    ],
)
def test_the_reason_for_no_new_maps_is_reported(controller: str, count: int, expected: str) -> None:
    rated = RatedController(controller, {})
    new_runs = verification._plan_new_runs(rated, {}, count, np.random.default_rng(0))
    assert new_runs.tasks == {}
    some = Verification(seed=0, rows=1, no_new_maps_reason=new_runs.absence_reason)
    assert any(line.startswith(f"No new maps tried: {expected}") for line in some.describe())
