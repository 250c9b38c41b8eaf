from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from swept import controller, small_study

from robocov.errors import OutputError
from robocov_app.sweep import local_pool as pool_module
from robocov_app.sweep.executor import Executor, LostWorker, Result
from robocov_app.sweep.local_pool import LocalPool, count_processors
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform

PATIENCE = 60.0

FINE = Outcome({}, {"contacts": 0})

KILLED = LostWorker("its process ended (signal 9)", "", is_caused_by_task=False)
CRASHED = LostWorker("its process ended (exit status 3)", "Fatal", is_caused_by_task=True)


def done_by(executor: Executor, tasks: list[Task]) -> dict[str, Outcome]:
    """Let a executor do tasks; return what came of them by name."""
    outcomes: dict[str, Outcome] = {}
    end = time.monotonic() + PATIENCE
    for task in tasks:
        executor.submit(task)
    while executor.unfinished_tasks:
        assert time.monotonic() < end
        back = executor.wait_for_next(0.1)
        if back is not None:
            outcomes[back[0].name] = back[1]
    return outcomes


class Scripted(Executor):
    """Returns what it is told to, first in, first out; remembers what was out at the same time."""

    def __init__(self, most: int, script: dict[str, list[Outcome | LostWorker]]) -> None:
        super().__init__()
        self._most, self._script = most, script
        self._queue: list[Task] = []
        self.together: list[tuple[str, int]] = []

    def __exit__(self, *exception: object) -> None: ...

    @property
    def capacity(self) -> int:
        return self._most

    def _start(self, task: Task) -> None:
        self._queue.append(task)

    def _wait_for_result(self, timeout: float) -> Result | None:
        if not self._queue:
            return None
        self.together.append((self._queue[0].name, len(self._queue)))
        task = self._queue.pop(0)
        came = self._script.get(task.name)
        return task, came.pop(0) if came else FINE


@pytest.fixture
def tasks() -> list[Task]:
    return list(generate_tasks(small_study(seeds=range(3))))


def test_no_more_is_handed_out_than_is_wanted(tasks: list[Task]) -> None:
    with Scripted(2, {}) as executor:
        assert executor.unfinished_tasks < executor.capacity
        for task in tasks[:2]:
            executor.submit(task)
        assert executor.unfinished_tasks == executor.capacity
        assert done_by(executor, tasks[2:]) == {task.name: FINE for task in tasks}
        assert max(count for _, count in executor.together) == 2


def test_a_task_that_is_not_to_blame_is_done_alone_and_does_not_fail_for_others(tasks: list[Task]) -> None:
    name = tasks[1].name
    with Scripted(3, {name: [KILLED, KILLED, FINE]}) as executor:
        assert done_by(executor, tasks) == {task.name: FINE for task in tasks}
    assert [count for other, count in executor.together if other == name][1:] == [1, 1]


def test_a_task_that_ends_its_worker_alone_twice_has_failed(tasks: list[Task]) -> None:
    name = tasks[1].name
    with Scripted(3, {name: [KILLED, KILLED, KILLED]}) as executor:
        outcomes = done_by(executor, tasks)
    assert outcomes.pop(name).error == "its process ended (signal 9)"
    assert outcomes == {task.name: FINE for task in tasks if task.name != name}


def test_a_task_that_is_to_blame_holds_nobody_up(tasks: list[Task]) -> None:
    name = tasks[1].name
    with Scripted(3, {name: [CRASHED, CRASHED]}) as executor:
        outcomes = done_by(executor, tasks)
    assert outcomes[name].error == "its process ended (exit status 3)"
    assert [count for other, count in executor.together if other == name] == [3, 3]
    assert len(outcomes) == len(tasks)


def test_workers_that_end_again_and_again_end_the_sweep() -> None:
    tasks = list(generate_tasks(small_study(seeds=range(20))))
    with Scripted(2, {task.name: [KILLED] * 9 for task in tasks}) as executor:
        told = pytest.raises(OutputError, match=r"workers have ended one after the other.*signal 9")
        with told:
            done_by(executor, tasks)
    assert executor.lost_workers == 21


@pytest.mark.slow
def test_processes_do_what_this_one_does(tasks: list[Task]) -> None:
    with LocalPool(2) as pool:
        assert done_by(pool, tasks) == {task.name: perform(task) for task in tasks}


@pytest.mark.slow
def test_a_process_that_ends_is_replaced(tmp_path: Path) -> None:
    """Both kinds of ends, what is said and read in a controller, and a process that is killed once."""
    flag = tmp_path / "killed"
    laws = {
        "exits.py": "        os._exit(3)\n",
        "kills.py": "        os.kill(os.getpid(), signal.SIGKILL)\n",
        "once.py": f"        if not Path({str(flag)!r}).exists():\n"
        f"            Path({str(flag)!r}).touch()\n"
        f"            os.kill(os.getpid(), signal.SIGKILL)\n",
        "talks.py": "        print('x' * 100_000)\n        assert not __import__('sys').stdin.read()\n",
        "crashes.py": "        import faulthandler; faulthandler._sigsegv()\n",
    }
    names = {file: controller(tmp_path, law, file) for file, law in laws.items()}
    study = small_study(controllers=("rapf", *names.values()), seeds=(0,))
    with LocalPool(2) as pool:
        outcomes = done_by(pool, list(generate_tasks(study)))
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
    (crashed,) = (task.name for task in generate_tasks(study) if "crashes.py" in task.controller)
    assert b"crashes.py" in outcomes[crashed].files["error.json"], "its last words say where"


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="looks at processes as Linux shows them")
@pytest.mark.slow
def test_nothing_is_left_of_a_pool(tmp_path: Path) -> None:
    awake = tmp_path / "awake"
    name = controller(tmp_path, f"        time.sleep(60)\n        Path({str(awake)!r}).touch()\n")
    others = children()  # of tests before this one
    with LocalPool(2) as pool:
        for task in generate_tasks(small_study(controllers=(name,))):
            pool.submit(task)
        end = time.monotonic() + PATIENCE
        while len(children() - others) < 2 and time.monotonic() < end:
            pool.wait_for_next(0.05)
        assert len(children() - others) == 2
    assert not awake.exists(), "nobody waits for what nobody wants any more"
    assert not children() - others


def children() -> set[int]:
    """Return the processes that this one has started."""
    found: set[int] = set()
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):
            found |= {int(pid) for pid in path.read_text().split()}
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="others notice it when Python has its turn again")
@pytest.mark.slow
def test_a_worker_ends_with_its_parent_also_in_the_midst_of_what_is_not_python(tmp_path: Path) -> None:
    flag = tmp_path / "asleep"
    law = (
        f"        Path({str(flag)!r}).write_text(str(os.getpid()) + ' ')\n"
        f"        __import__('ctypes').PyDLL(None).sleep(600)\n"  # keeps all other threads from running
    )
    script = (
        "import sys\nfrom swept import small_study\nfrom robocov_app.sweep.sweeping import sweep\n"
        "sweep(small_study(controllers=(sys.argv[1],), seeds=(0,)), sys.argv[2], workers=1)\n"
    )
    command = [sys.executable, "-c", script, controller(tmp_path, law), str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as process:
        end = time.monotonic() + PATIENCE
        while not (flag.exists() and flag.read_text().endswith(" ")) and time.monotonic() < end:
            time.sleep(0.01)
        worker = Path("/proc") / flag.read_text().strip()
        assert worker.exists()
        process.kill()
    end = time.monotonic() + PATIENCE
    while worker.exists() and "State:\tZ" not in (worker / "status").read_text():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_where_no_process_can_begin_it_is_said_why(
    tasks: list[Task], monkeypatch: pytest.MonkeyPatch
) -> None:
    start_process = pool_module.start_process
    monkeypatch.setattr(
        pool_module, "start_process", lambda _, **said: start_process("robocov_app.sweep.nothing", **said)
    )
    with (
        LocalPool(1) as pool,
        pytest.raises(OutputError, match=r"no process for the runs can be started: .*nothing"),
    ):
        done_by(pool, tasks[:1])


def test_the_number_of_processors_is_what_this_process_may_use() -> None:
    assert 1 <= count_processors() <= (os.cpu_count() or 1)
    if sys.platform == "linux":
        assert count_processors() == len(os.sched_getaffinity(0))


@pytest.mark.skipif(sys.platform == "win32", reason="processes are ended by signals")
def test_a_worker_that_is_killed_while_it_starts_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever kills it, as a system without memory does, before it has said anything."""

    def start(service: str, **options: object) -> subprocess.Popen[bytes]:
        dying = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
        pipe = subprocess.PIPE
        return subprocess.Popen([sys.executable, "-c", dying], stdin=pipe, stdout=pipe)

    monkeypatch.setattr(pool_module, "start_process", start)
    with LocalPool(1) as pool:
        pool.submit(next(iter(generate_tasks(small_study()))))
        ending = r"worker killed by signal 9 \(SIGKILL\) while starting$"
        with pytest.raises(OutputError, match=ending):
            pool.wait_for_next(PATIENCE)
