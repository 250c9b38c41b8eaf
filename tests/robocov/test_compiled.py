"""Compiled kernels: their cache, its permissions, and runs without the compiler."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov import compiled
from robocov.compiled import kernel, report_compilation
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.kernel_compilation import compile_kernels
from robocov.mapfile import load_map
from robocov.metrics import compute_cost_history, summarize
from robocov.record import Recorder
from robocov.simulation import Simulation

ROOT = Path(__file__).parents[2]

FACTOR = 3.0

KERNEL_MODULE = """
from robocov.compiled import kernel

@kernel
def double(x):
    return 2.0 * x
"""
KERNEL_SCRIPT = """
import sys
from robocov.compiled import report_compilation
from kernel_module import double
assert "numba" not in sys.modules
with report_compilation(print):
    print(double(0.5))
"""


@pytest.fixture
def kernel_folder(tmp_path: Path) -> Path:
    """A folder with a module that defines a kernel: numba caches only functions of files."""
    folder = tmp_path / "module"
    folder.mkdir()
    (folder / "kernel_module.py").write_text(KERNEL_MODULE)
    return folder


def run_script(script: str, folder: Path, cache: Path | str, *, jit: bool = True) -> list[str]:
    """Run a script in a process of its own, from the root of the checkout, and return the words it prints."""
    search_path = [folder, ROOT, ROOT / "coverage", ROOT / "app"]
    variables = {
        "NUMBA_CACHE_DIR": str(cache),
        "NUMBA_DISABLE_JIT": str(int(not jit)),
        "PYTHONPATH": os.pathsep.join(map(str, search_path)),
    }
    finished = subprocess.run(
        [sys.executable, "-c", script],
        cwd=ROOT,
        env=os.environ | variables,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return finished.stdout.split()


@pytest.mark.slow
def test_second_process_loads_kernel_from_cache(tmp_path: Path, kernel_folder: Path) -> None:
    cache = tmp_path / "cache"
    assert run_script(KERNEL_SCRIPT, kernel_folder, cache) == ["double", "1.0"]
    assert run_script(KERNEL_SCRIPT, kernel_folder, cache) == ["1.0"]


@pytest.mark.slow
def test_damaged_cache_counts_as_empty(tmp_path: Path, kernel_folder: Path) -> None:
    cache = tmp_path / "cache"
    run_script(KERNEL_SCRIPT, kernel_folder, cache)
    (index,) = cache.rglob("*.nbi")
    index.write_bytes(b"")
    assert run_script(KERNEL_SCRIPT, kernel_folder, cache) == ["double", "1.0"]


@pytest.mark.slow
def test_unwritable_cache_folder_is_ignored(tmp_path: Path, kernel_folder: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    assert run_script(KERNEL_SCRIPT, kernel_folder, tmp_path / "file") == ["double", "1.0"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps users apart by itself")
def test_machine_code_that_others_may_write_is_never_loaded(tmp_path: Path, kernel_folder: Path) -> None:
    cache = tmp_path / "cache"
    run_script(KERNEL_SCRIPT, kernel_folder, cache)
    (version,) = cache.iterdir()
    version.chmod(0o777)
    assert run_script(KERNEL_SCRIPT, kernel_folder, cache) == ["double", "1.0"]


def test_changed_source_changes_cache_folder(tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text("x = 1")
    before = compiled._compute_installation_digest(tmp_path)
    assert compiled._compute_installation_digest(tmp_path) == before
    (tmp_path / "one.py").write_text("x = 2")
    assert compiled._compute_installation_digest(tmp_path) != before


@pytest.mark.skipif(sys.platform != "linux", reason="needs a file system with names of any bytes")
def test_the_folder_of_an_installation_may_have_any_name(tmp_path: Path) -> None:
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9"))
    folder.mkdir()
    assert compiled._compute_installation_digest(folder).startswith("robocov-")


def test_installations_of_one_version_have_cache_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba does not find the machine code of the other one: it must not count as ready."""
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "one.py").write_text("x = 1")
    first = compiled._compute_installation_digest(tmp_path / "first")
    assert compiled._compute_installation_digest(tmp_path / "second") != first
    monkeypatch.setattr("sys.implementation.cache_tag", "cpython-399")
    assert compiled._compute_installation_digest(tmp_path / "first") != first


def test_versions_unused_for_long_are_removed(tmp_path: Path) -> None:
    for k in range(6):
        folder = tmp_path / f"robocov-{k}"
        folder.mkdir()
        if k < 3:
            os.utime(folder, (1000.0 + k, 1000.0 + k))
    (tmp_path / "other").mkdir()
    compiled._remove_unused_versions(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "other",
        "robocov-2",
        "robocov-3",
        "robocov-4",
        "robocov-5",
    ]


def test_kernels_of_a_run_are_compiled_beforehand() -> None:
    compile_kernels()
    newly_compiled: list[str] = []
    with report_compilation(newly_compiled.append):
        rooms = load_map("rooms")
        simulation = Simulation(rooms, Rapf(), rooms.start().sample(6))
        recorder = Recorder(rooms, simulation.team, Rapf(), simulation.dt)
        for snapshot in simulation.snapshots(0.1):
            recorder.add(snapshot)
        record = recorder.record()
        summarize(record, compute_cost_history(record, CoverageCost(rooms, 16)))
    assert newly_compiled == []


def test_without_the_compiler_kernels_are_python(tmp_path: Path, kernel_folder: Path) -> None:
    script = KERNEL_SCRIPT + "print('numba' in sys.modules)"
    assert run_script(script, kernel_folder, tmp_path, jit=False) == ["1.0", "False"]


@kernel
def triple(x: float) -> float:
    return FACTOR * x


@kernel
def sum_triples(values: np.ndarray) -> float:
    total = 0.0
    for value in values:
        total += triple(x=value)
    return total


def test_kernels_call_kernels_also_by_keyword() -> None:
    assert sum_triples(values=np.array([1.0, 2.0])) == 9.0
    assert triple(2.0) == 6.0


def test_kernels_cannot_write_into_frozen_arrays() -> None:
    @kernel
    def clear(values: np.ndarray) -> None:
        values[0] = 0.0

    values = np.ones(3)
    clear(values)
    assert values[0] == 0.0
    values.setflags(write=False)
    with pytest.raises(Exception, match="readonly"):
        clear(values)


def test_compilation_is_reported_once() -> None:
    reported: list[str] = []
    # A function without a file is not cached, so that it is compiled each time the test runs.
    namespace: dict[str, Any] = {}
    exec("def halve(x): return 0.5 * x", namespace)
    halve = kernel(namespace["halve"])
    with report_compilation(reported.append):
        assert halve(3.0) == 1.5
        assert halve(5.0) == 2.5
    assert reported == ["halve"]


@pytest.mark.slow
@pytest.mark.parametrize("command", [["--help"], ["maps"]])
def test_commands_without_measurements_do_not_load_the_compiler(command: list[str], tmp_path: Path) -> None:
    script = f"""
import sys, contextlib, io
from robocov_app.cli import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main({command})
print("numba" in sys.modules)
"""
    assert run_script(script, tmp_path, os.environ["NUMBA_CACHE_DIR"])[-1] == "False"


def test_kernel_that_cannot_be_compiled_fails_each_time() -> None:
    @kernel
    def use_missing_name(x: float) -> float:
        return x + nowhere  # type: ignore[name-defined] # noqa: F821

    for _ in range(2):
        with pytest.raises(Exception, match="nowhere"):
            use_missing_name(1.0)


def test_ctrl_c_during_a_call_is_a_keyboard_interrupt() -> None:
    """Numba's dispatcher turns it into a SystemError."""

    def interrupt(*args: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error

    interrupted = compiled.Kernel(lambda x: x)
    interrupted._dispatcher = interrupt
    with pytest.raises(KeyboardInterrupt):
        interrupted(1)
