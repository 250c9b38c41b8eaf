"""Executors of sweeps: capacity, and workers that crash or are killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from small_studies import build_small_study, write_controller

from robocov.errors import OutputError
from robocov_app.sweep import local_pool as pool_module
from robocov_app.sweep.executor import Executor, LostWorker, Result
from robocov_app.sweep.local_pool import LocalPool, count_processors
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform

HANG_LIMIT_S = 60.0

FINE = Outcome({}, {"contacts": 0})

KILLED = LostWorker("its process ended (signal 9)", "", is_caused_by_task=False)
CRASHED = LostWorker("its process ended (exit status 3)", "Fatal", is_caused_by_task=True)


def execute(executor: Executor, tasks: list[Task]) -> dict[str, Outcome]:
    """Execute tasks, and return their outcomes by name."""
    outcomes: dict[str, Outcome] = {}
    end = time.monotonic() + HANG_LIMIT_S
    for task in tasks:
        executor.submit(task)
    while executor.unfinished_tasks:
        assert time.monotonic() < end
        result = executor.wait_for_next(0.1)
        if result is not None:
            task, outcome = result
            outcomes[task.name] = outcome
    return outcomes


class ScriptedExecutor(Executor):
    """Returns outcomes of a script, first in, first out; records the number of simultaneous tasks."""

    def __init__(self, capacity: int, script: dict[str, list[Outcome | LostWorker]]) -> None:
        super().__init__()
        self._capacity = capacity
        self._script = script
        self._queue: list[Task] = []
        self.task_counts: list[tuple[str, int]] = []

    def __exit__(self, *exception: object) -> None: ...

    @property
    def capacity(self) -> int:
        return self._capacity

    def _start(self, task: Task) -> None:
        self._queue.append(task)

    def _wait_for_result(self, timeout: float) -> Result | None:
        if not self._queue:
            return None
        self.task_counts.append((self._queue[0].name, len(self._queue)))
        task = self._queue.pop(0)
        outcomes = self._script.get(task.name)
        return task, outcomes.pop(0) if outcomes else FINE


@pytest.fixture
def tasks() -> list[Task]:
    return list(generate_tasks(build_small_study(seeds=range(3))))


def test_an_executor_gets_no_more_tasks_than_its_capacity(tasks: list[Task]) -> None:
    with ScriptedExecutor(2, {}) as executor:
        assert executor.unfinished_tasks < executor.capacity
        for task in tasks[:2]:
            executor.submit(task)
        assert executor.unfinished_tasks == executor.capacity
        assert execute(executor, tasks[2:]) == {task.name: FINE for task in tasks}
        assert max(count for _, count in executor.task_counts) == 2


def test_a_task_whose_worker_was_killed_is_repeated_alone(tasks: list[Task]) -> None:
    name = tasks[1].name
    with ScriptedExecutor(3, {name: [KILLED, KILLED, FINE]}) as executor:
        assert execute(executor, tasks) == {task.name: FINE for task in tasks}
    assert [count for other, count in executor.task_counts if other == name][1:] == [1, 1]


def test_a_task_whose_worker_is_killed_twice_while_alone_fails(tasks: list[Task]) -> None:
    name = tasks[1].name
    with ScriptedExecutor(3, {name: [KILLED, KILLED, KILLED]}) as executor:
        outcomes = execute(executor, tasks)
    assert outcomes.pop(name).error == "its process ended (signal 9)"
    assert outcomes == {task.name: FINE for task in tasks if task.name != name}


def test_a_task_that_crashes_its_worker_does_not_delay_the_others(tasks: list[Task]) -> None:
    name = tasks[1].name
    with ScriptedExecutor(3, {name: [CRASHED, CRASHED]}) as executor:
        outcomes = execute(executor, tasks)
    assert outcomes[name].error == "its process ended (exit status 3)"
    assert [count for other, count in executor.task_counts if other == name] == [3, 3]
    assert len(outcomes) == len(tasks)


def test_a_sweep_ends_if_too_many_workers_end() -> None:
    tasks = list(generate_tasks(build_small_study(seeds=range(20))))
    with (
        ScriptedExecutor(2, {task.name: [KILLED] * 9 for task in tasks}) as executor,
        pytest.raises(OutputError, match=r"workers ended in a row.*signal 9"),
    ):
        execute(executor, tasks)
    assert executor.lost_workers == 21


@pytest.mark.slow
def test_processes_return_the_same_outcomes_as_this_process(tasks: list[Task]) -> None:
    with LocalPool(2) as pool:
        assert execute(pool, tasks) == {task.name: perform(task) for task in tasks}


@pytest.mark.slow
def test_a_process_that_ends_is_replaced(tmp_path: Path) -> None:
    """Controllers exit, kill their process, kill it once, print and read, and crash."""
    flag = tmp_path / "killed"
    codes = {
        "exits.py": "        os._exit(3)\n",
        "kills.py": "        os.kill(os.getpid(), signal.SIGKILL)\n",
        "once.py": f"        if not Path({str(flag)!r}).exists():\n"
        f"            Path({str(flag)!r}).touch()\n"
        f"            os.kill(os.getpid(), signal.SIGKILL)\n",
        "talks.py": "        print('x' * 100_000)\n        assert not __import__('sys').stdin.read()\n",
        "crashes.py": "        import faulthandler; faulthandler._sigsegv()\n",
    }
    names = {file: write_controller(tmp_path, code, file) for file, code in codes.items()}
    study = build_small_study(controllers=("rapf", *names.values()), seeds=(0,))
    with LocalPool(2) as pool:
        outcomes = execute(pool, list(generate_tasks(study)))
    errors = {
        task.controller.rpartition(":")[0].rpartition("/")[2]: outcomes[task.name].error
        for task in generate_tasks(study)
    }
    assert errors == {
        "": None,
        "exits.py": f"controller {names['exits.py']!r}: its process ended (exit status 3)",
        "kills.py": f"controller {names['kills.py']!r}: its process ended (killed by signal 9 (SIGKILL))",
        "once.py": None,
        "talks.py": None,
        "crashes.py": f"controller {names['crashes.py']!r}: its process ended "
        "(killed by signal 11 (SIGSEGV))",
    }
    (crashed,) = [task.name for task in generate_tasks(study) if "crashes.py" in task.controller]
    assert b"crashes.py" in outcomes[crashed].files["error.json"], "the last output names the file"


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="reads processes from /proc")
@pytest.mark.slow
def test_a_pool_leaves_no_process(tmp_path: Path) -> None:
    awake = tmp_path / "awake"
    name = write_controller(tmp_path, f"        time.sleep(60)\n        Path({str(awake)!r}).touch()\n")
    others = list_children()  # Processes of earlier tests.
    with LocalPool(2) as pool:
        for task in generate_tasks(build_small_study(controllers=(name,))):
            pool.submit(task)
        end = time.monotonic() + HANG_LIMIT_S
        while len(list_children() - others) < 2 and time.monotonic() < end:
            pool.wait_for_next(0.05)
        assert len(list_children() - others) == 2
    assert not awake.exists(), "a pool that is closed does not wait for its tasks"
    assert not list_children() - others


def list_children() -> set[int]:
    """Return the child processes of this process."""
    children: set[int] = set()
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):
            children |= {int(pid) for pid in path.read_text().split()}
    return children


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere only Python code notices the end of the parent"
)
@pytest.mark.slow
def test_a_worker_ends_with_its_parent_while_compiled_code_runs(tmp_path: Path) -> None:
    flag = tmp_path / "asleep"
    code = (
        f"        Path({str(flag)!r}).write_text(str(os.getpid()) + ' ')\n"
        f"        __import__('ctypes').PyDLL(None).sleep(600)\n"  # No other thread can run.
    )
    script = (
        "import sys\n"
        "from small_studies import build_small_study\n"
        "from robocov_app.sweep.sweeping import sweep\n"
        "sweep(build_small_study(controllers=(sys.argv[1],), seeds=(0,)), sys.argv[2], workers=1)\n"
    )
    command = [sys.executable, "-c", script, write_controller(tmp_path, code), str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as process:
        end = time.monotonic() + HANG_LIMIT_S
        while not (flag.exists() and flag.read_text().endswith(" ")) and time.monotonic() < end:
            time.sleep(0.01)
        worker = Path("/proc") / flag.read_text().strip()
        assert worker.exists()
        process.kill()
    end = time.monotonic() + HANG_LIMIT_S
    while worker.exists() and "State:\tZ" not in (worker / "status").read_text():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_the_reason_is_reported_if_no_process_can_start(
    tasks: list[Task], monkeypatch: pytest.MonkeyPatch
) -> None:
    start_process = pool_module.start_process
    monkeypatch.setattr(
        pool_module,
        "start_process",
        lambda _, **options: start_process("robocov_app.sweep.nothing", **options),
    )
    with (
        LocalPool(1) as pool,
        pytest.raises(OutputError, match=r"a worker process cannot be started: .*nothing"),
    ):
        execute(pool, tasks[:1])


def test_only_the_processors_of_this_process_are_counted() -> None:
    assert 1 <= count_processors() <= (os.cpu_count() or 1)
    if sys.platform == "linux":
        assert count_processors() == len(os.sched_getaffinity(0))


@pytest.mark.skipif(sys.platform == "win32", reason="processes are ended by signals")
def test_a_worker_that_is_killed_while_it_starts_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:

    def start(service: str, **options: object) -> subprocess.Popen[bytes]:
        script = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
        pipe = subprocess.PIPE
        return subprocess.Popen([sys.executable, "-c", script], stdin=pipe, stdout=pipe)

    monkeypatch.setattr(pool_module, "start_process", start)
    with LocalPool(1) as pool:
        pool.submit(next(iter(generate_tasks(build_small_study()))))
        with pytest.raises(OutputError, match=r"worker killed by signal 9 \(SIGKILL\) while starting$"):
            pool.wait_for_next(HANG_LIMIT_S)
