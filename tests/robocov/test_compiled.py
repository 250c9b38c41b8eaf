from __future__ import annotations

import gc
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from robocov import compiled
from robocov.compiled import _KernelCache, compile_kernels, kernel, on_compile
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.mapfile import load_map
from robocov.metrics import cost_history, summarise
from robocov.record import Recorder
from robocov.simulation import Simulation

ROOT = Path(__file__).parents[2]

FACTOR = 3.0

SCRIPT = """
import ctypes, sys
from robocov.compiled import call_c, kernel, on_compile
assert "numba" not in sys.modules
on_compile.append(print)
@kernel
def doubled(x, address):
    return 2.0 * x if call_c(address, (0, x)) else x
print(doubled(0.5, ctypes.cast(ctypes.pythonapi.Py_IsInitialized, ctypes.c_void_p).value))
"""


def started(folder, *, jit=True, script=SCRIPT):
    """Start a script in the checkout's root that calls a kernel."""
    variables = {
        "NUMBA_CACHE_DIR": str(folder),
        "NUMBA_DISABLE_JIT": str(int(not jit)),
        "PYTHONPATH": os.pathsep.join(str(ROOT / part) for part in ("", "coverage", "app")),
    }
    command = [sys.executable, "-c", script]
    return subprocess.Popen(command, cwd=ROOT, env=os.environ | variables, stdout=subprocess.PIPE, text=True)


def said(*args, **options):
    """Return what such a script says."""
    process = started(*args, **options)
    answer, _ = process.communicate()
    assert process.returncode == 0
    return answer.split()


@pytest.mark.slow
def test_a_kernel_is_compiled_once_and_a_damaged_cache_is_a_miss(tmp_path):
    assert said(tmp_path) == ["doubled", "1.0"]
    (entry,) = tmp_path.iterdir()
    assert said(tmp_path) == ["1.0"]
    whole = entry.read_bytes()
    for damaged in (b"", whole[:1000], whole[:-1] + b"?"):
        entry.write_bytes(damaged)
        assert said(tmp_path) == ["doubled", "1.0"]


@pytest.mark.slow
def test_of_several_processes_one_compiles(tmp_path):
    script = SCRIPT + "print(sum(doubled._dispatcher._cache_hits.values()))"
    processes = [started(tmp_path, script=script) for _ in range(3)]
    hits = [int(process.communicate()[0].split()[-1]) for process in processes]
    assert sorted(hits) == [0, 1, 1]
    assert len(list(tmp_path.iterdir())) == 1


def test_all_kernels_of_a_step_and_of_the_cost_are_there_before_a_run(monkeypatch):
    compile_kernels()
    monkeypatch.setattr(_KernelCache, "load_overload", lambda *_: pytest.fail("another signature"))
    rooms = load_map("rooms")
    simulation = Simulation(rooms, Rapf(), rooms.start().sample(6))
    recorder = Recorder(rooms, simulation.team, Rapf(), simulation.dt)
    for snapshot in simulation.snapshots(0.1):
        recorder.add(snapshot)
    record = recorder.record()
    summarise(record, cost_history(record, CoverageCost(rooms, 16)))


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    (tmp_path / "file").write_text("no folder")
    assert said(tmp_path / "file") == ["doubled", "1.0"]


def test_without_the_compiler_kernels_are_python(tmp_path):
    script = SCRIPT + "print('numba' in sys.modules)"
    assert said(tmp_path, jit=False, script=script) == ["1.0", "False"]


@kernel
def tripled(x):
    return FACTOR * x


@kernel
def summed(values):
    total = 0.0
    for value in values:
        total += tripled(value)
    return total


def test_kernels_call_kernels():
    assert summed(np.array([1.0, 2.0])) == 9.0
    assert tripled(2.0) == 6.0


def test_arrays_that_may_not_be_written_are_no_other_type():
    @kernel
    def first(values):
        return values[0]

    values = np.arange(3.0)
    assert first(values) == 0.0
    values.setflags(write=False)
    assert first(values) == 0.0
    assert len(first._dispatcher.signatures) == 1


def test_what_is_compiled_is_told(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told = []
    on_compile.append(told.append)
    try:

        @kernel
        def halved(x):
            return 0.5 * x

        assert halved(3.0) == 1.5
        assert halved(5.0) == 2.5
        assert told == ["halved"]
    finally:
        on_compile.remove(told.append)


@pytest.mark.slow
@pytest.mark.parametrize("command", [["--help"], ["maps"]])
def test_commands_that_measure_nothing_do_not_load_the_compiler(command):
    script = f"""
import sys, contextlib, io
from robocov_app.cli import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main({command})
print("numba" in sys.modules)
"""
    assert said(os.environ["NUMBA_CACHE_DIR"], script=script)[-1] == "False"


@pytest.mark.timeout(60)
def test_a_kernel_that_cannot_be_compiled_says_so_each_time(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "_PATIENCE", math.inf)

    @kernel
    def missing(x):
        return x + nowhere  # noqa: F821

    for _ in range(2):  # the first attempt leaves no lock behind
        with pytest.raises(Exception, match="nowhere"):
            missing(1.0)
        assert gc.isenabled()


def test_ctrl_c_amid_a_call_is_ctrl_c() -> None:
    """numba's dispatcher makes a SystemError of it."""
    from robocov.compiled import Kernel

    def interrupted(*args: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error

    kernel = Kernel(lambda x: x, {})
    kernel.__dict__["_dispatcher"] = interrupted
    with pytest.raises(KeyboardInterrupt):
        kernel(1)
