"""The same tasks on a Dask cluster: the same table, byte for byte."""

from __future__ import annotations

import builtins
import logging
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from command_calls import read_json
from small_studies import build_small_study, read_tables, write_controller

from robocov.errors import OutputError, RobocovError
from robocov_app.cli import main
from robocov_app.sweep import cluster as cluster_module
from robocov_app.sweep.cluster import Cluster
from robocov_app.sweep.sweeping import Totals, sweep
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import perform

distributed = pytest.importorskip("distributed")

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("cluster")]


@contextmanager
def open_cluster(*, processes: bool, workers: int = 1) -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=2,
        processes=processes,
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
    ) as cluster:
        yield cluster


def test_a_cluster_gives_the_same_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = build_small_study(seeds=range(4), robots=(2, 500), gains={"rapf": {"k_rep": [0.1, 1.0]}})
    expected = Totals(12, 12, 0, False)
    assert sweep(study, tmp_path / "here", workers=1, quiet=True) == expected
    with open_cluster(processes=False) as cluster:
        address = cluster.scheduler_address
        assert sweep(study, tmp_path / "there", scheduler=address, quiet=True) == expected
        with Cluster(address) as executor:
            assert (executor.threads, executor.capacity) == (2, 4)
        file = tmp_path / "study.toml"
        file.write_text('maps = "square"\ncontrollers = "rapf"\nduration = 0.1\nlattice = 8\n')
        words = ("sweep", str(file), "--dry-run", "--scheduler", address)
        assert read_json(capsys, *words)["workers"] == 2
    assert read_tables(tmp_path / "there") == read_tables(tmp_path / "here")


def test_only_tasks_that_end_their_process_fail(tmp_path: Path) -> None:
    """Dask blames all tasks that were with a worker when it ended; only one of them is at fault."""
    dask = pytest.importorskip("dask")
    name = write_controller(tmp_path, "        os._exit(3)\n")
    study = build_small_study(controllers=("rapf", name), seeds=range(2))
    strict = dask.config.set({"distributed.scheduler.allowed-failures": 0})
    # Two workers, because Dask sometimes does not restart a worker.
    with strict, open_cluster(processes=True, workers=2) as cluster:
        totals = sweep(study, tmp_path / "out", scheduler=cluster.scheduler_address, quiet=True)
    assert totals == Totals(2, 2, 0, False)
    lines = (tmp_path / "out" / "results.csv").read_text().splitlines()[1:]
    ends = [line.rpartition(",")[2] for line in lines]
    assert ends == ["", "the process of its worker ended"] * 2


def test_a_sweep_waits_for_workers_and_resumes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_THREAD_COUNT_INTERVAL_S", 0.05)
    task = next(generate_tasks(build_small_study()))
    with open_cluster(processes=False, workers=0) as cluster, Cluster(cluster.scheduler_address) as executor:
        executor.submit(task)
        assert executor.wait_for_next(0.1) is None
        assert executor.waiting_reason == f"no workers are connected to {cluster.scheduler_address}; waiting"
        cluster.scale(1)
        while (result := executor.wait_for_next(0.1)) is None:
            pass
        assert result[1].error is None
        while executor.waiting_reason:  # until it looks again
            pass


def test_imported_modules_reach_workers_without_access_to_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "weights_of_mine.py").write_text("PULL = 0.5\n")
    name = write_controller(tmp_path, "        from weights_of_mine import PULL\n        self = Mine(PULL)\n")
    (task, *_) = generate_tasks(build_small_study(controllers=(name,)))
    local_outcome = perform(task)
    for path in tmp_path.iterdir():
        path.unlink()
    with open_cluster(processes=True) as cluster, Cluster(cluster.scheduler_address) as executor:
        executor.submit(task)
        while (result := executor.wait_for_next(0.1)) is None:
            pass
    assert result[1] == local_outcome
    assert local_outcome.error is None


def test_a_lost_scheduler_ends_the_sweep_and_the_same_call_resumes_it(tmp_path: Path) -> None:
    name = write_controller(tmp_path, "        time.sleep(0.02)\n")
    study = build_small_study(controllers=(name,), seeds=range(12))
    with open_cluster(processes=False) as cluster, Cluster(cluster.scheduler_address) as executor:
        for task in generate_tasks(study):
            executor.submit(task)
        while executor.wait_for_next(0.1) is None:
            pass
        cluster.close()
        with pytest.raises(OutputError, match=r"--scheduler: inproc://.*: the runs cannot continue: "):
            while executor.unfinished_tasks:
                executor.wait_for_next(0.1)


def test_a_missing_scheduler_is_reported_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "CONNECTION_TIMEOUT_S", 0.5)
    study = tmp_path / "study.toml"
    study.write_text('maps = "square"\ncontrollers = "rapf"\nduration = 0.1\nlattice = 8\n')
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        for address, reason in (
            (f"tcp://127.0.0.1:{silent.getsockname()[1]}", "no answer within 0.5 s"),
            ("tcp://127.0.0.1:9", "Timed out"),
            ("nonsense", "missing port number"),
            ("pigeon://home:1", "unknown address scheme"),
        ):
            words = ["sweep", str(study), "--out", str(tmp_path / "out"), "--scheduler", address]
            assert main(words) == 2
            (line,) = (line for line in capsys.readouterr().err.splitlines() if "error" in line)
            assert line.startswith(f"robocov: error: --scheduler: {address}: cannot be reached: ")
            assert reason in line or "no answer" in line
    assert list((tmp_path / "out" / "runs").iterdir()) == []


def test_without_dask_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    message = r'--scheduler: distributed is not installed: pip install "robocov\[dask\]"'
    with pytest.raises(RobocovError, match=message):
        Cluster("tcp://127.0.0.1:9")


def test_workers_without_robocov_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def raise_missing(task: object) -> None:
        raise ModuleNotFoundError("No module named 'robocov_app'")

    task = next(generate_tasks(build_small_study()))
    monkeypatch.setattr(cluster_module, "perform", raise_missing)
    with open_cluster(processes=False) as cluster, Cluster(cluster.scheduler_address) as executor:
        executor.submit(task)
        with pytest.raises(OutputError, match="ModuleNotFoundError: No module named 'robocov_app'"):
            while executor.unfinished_tasks:
                executor.wait_for_next(0.1)


def test_threads_of_a_worker_share_no_state() -> None:
    from concurrent.futures import ThreadPoolExecutor

    tasks = list(generate_tasks(build_small_study(seeds=range(8))))
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(perform, tasks)) == [perform(task) for task in tasks]


def test_dask_is_not_imported_without_a_scheduler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    imported = builtins.__import__

    def watch(name: str, *rest: Any, **more: Any) -> Any:
        assert name.partition(".")[0] not in ("dask", "distributed")
        return imported(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", watch)
    assert sweep(build_small_study(seeds=(0,)), tmp_path, workers=1, quiet=True).done == 2
