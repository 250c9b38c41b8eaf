"""Compilation of kernels: examples, interpreted kernels and the background process."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov import compiled, kernel_compilation
from robocov.compiled import (
    IS_COMPILER_ENABLED,
    Kernel,
    interpret_kernels,
    is_interpreting,
    open_cache_folder,
)
from robocov.controllers import Controller, Lloyd, Rapf
from robocov.environment import Environment
from robocov.kernel_compilation import (
    are_kernels_compiled,
    call_path_kernels,
    call_planning_kernels,
    compile_in_background,
    compile_kernels,
    is_compiling_in_background,
)
from robocov.simulation import Simulation
from robocov.team import Team

ROOT = Path(__file__).parents[2]
PATIENCE_S = 120.0

pytestmark = pytest.mark.skipif(not IS_COMPILER_ENABLED, reason="kernels are Python without the compiler")


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    open_cache_folder.cache_clear()
    folder = open_cache_folder()
    assert folder is not None
    yield folder
    open_cache_folder.cache_clear()


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("controller", "team"),
    [
        (Rapf(), Team.homogeneous(5)),
        (Lloyd(), Team.homogeneous(20)),
        (Rapf(), Team.homogeneous(5, kinematics="unicycle", communication_range=2.0)),
    ],
)
def test_interpreted_kernels_give_the_same_bits(
    cluttered: Environment, controller: Controller, team: Team
) -> None:
    starts = cluttered.start("uniform").sample(len(team), seed=1)
    compiled_run = Simulation(cluttered, controller, starts, team)
    interpreted_run = Simulation(cluttered, controller, starts, team)
    for _ in range(60):
        compiled_run.step()
    interpret_kernels(lambda name, arguments: True)
    try:
        for _ in range(60):
            interpreted_run.step()
    finally:
        interpret_kernels(None)
    assert np.array_equal(interpreted_run.positions, compiled_run.positions)
    assert np.array_equal(interpreted_run.velocities, compiled_run.velocities)


def test_only_kernels_that_must_be_are_interpreted() -> None:
    def first(x: float) -> object:
        return type(x)

    def second(x: float) -> float:
        return 2.0 * x

    kernels = [Kernel(first), Kernel(second)]
    interpret_kernels(lambda name, arguments: name == kernels[0].name)
    try:
        assert kernels[0](1.0) is float
        assert kernels[1](1.0) == 2.0
    finally:
        interpret_kernels(None)
    assert [kernel.is_compiled for kernel in kernels] == [False, True]


def test_examples_are_called_once_for_a_cache(empty_cache: Path) -> None:
    calls: list[str] = []

    def example() -> None:
        calls.append("called")

    assert not are_kernels_compiled([example])
    compile_kernels([example])
    compile_kernels([example])
    assert calls == ["called"]
    assert are_kernels_compiled([example])


def test_without_a_cache_examples_are_called_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robocov.kernel_compilation.open_cache_folder", lambda: None)
    calls: list[str] = []
    compile_kernels([lambda: calls.append("first"), lambda: calls.append("second")])
    assert calls == ["first", "second"]
    with compile_in_background():
        assert not is_interpreting(), "machine code of another process could not be loaded"


def test_another_process_compiles_until_it_ends(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def start_reading_process() -> subprocess.Popen[bytes]:
        """Start a process that compiles nothing, and ends with its standard input."""
        return subprocess.Popen([sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE)

    monkeypatch.setattr(kernel_compilation, "_start_compilation_process", start_reading_process)
    assert not is_compiling_in_background()
    with compile_in_background():
        assert is_compiling_in_background()
        compilation = kernel_compilation._background_compilation
        assert compilation is not None and compilation._process is not None
        assert compilation._process.stdin is not None
        compilation._process.stdin.close()
        wait_until(lambda: not is_compiling_in_background())
    assert not is_compiling_in_background()


def test_a_kernel_is_interpreted_for_types_without_machine_code(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel_compilation, "_start_compilation_process", lambda: None)
    double = Kernel(lambda x: 2.0 * x)
    double(1.5)
    kernel_compilation._save_compiled_list(empty_cache)
    compilation = kernel_compilation._BackgroundCompilation(empty_cache)
    wait_until(lambda: not compilation.must_interpret(double.name, (1.5,)))
    assert compilation.must_interpret(double.name, (np.ones(3),))
    double(np.ones(3))
    kernel_compilation._save_compiled_list(empty_cache)
    compilation._poll()
    assert not compilation.must_interpret(double.name, (np.ones(3),))
    read_only = np.ones(3)
    read_only.setflags(write=False)
    assert compilation.must_interpret(double.name, (read_only,))


@pytest.mark.slow
def test_examples_call_the_kernels_of_planned_routes() -> None:
    """Examples on an open map did not, so that windows compiled these kernels at the first detour."""
    call_path_kernels()
    call_planning_kernels()
    compiled_types = compiled.list_compiled_kernels()
    assert "robocov.geodesic.geodesics._find_corner_distances" in compiled_types
    nodes = compiled_types["robocov.planning.lattice.find_nearest_nodes"]
    for position_type in ("array(float64, 1d, C)", "readonly array(float64, 1d, C)"):
        assert any(types.startswith(f"{position_type};") for types in nodes), nodes


NET_FORCES = "robocov.world.dynamics.compute_net_forces"
COMPILE_NET_FORCES = """
import pickle, sys
from pathlib import Path
from robocov import kernel_compilation
from robocov.compiled import interpret_kernels

def step_simulation():
    interpret_kernels(lambda name, arguments: name != sys.argv[2])
    pickle.loads(Path(sys.argv[1]).read_bytes()).step()

kernel_compilation.ALL_EXAMPLES = (step_simulation,)
kernel_compilation.main()
sys.stdin.read()  # As if it compiled further kernels.
"""


@pytest.mark.slow
def test_kernels_are_interpreted_until_another_process_has_compiled_them(
    empty_cache: Path, cluttered: Environment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulation = Simulation(cluttered, Rapf(), cluttered.start("uniform").sample(4, seed=1))
    simulation_file = tmp_path / "simulation.pickle"
    simulation_file.write_bytes(pickle.dumps(simulation))

    def start_compilation_process() -> subprocess.Popen[bytes]:
        """Start a process that only compiles this kernel."""
        command = [sys.executable, "-P", "-c", COMPILE_NET_FORCES, str(simulation_file), NET_FORCES]
        variables = {"PYTHONPATH": str(ROOT / "coverage")}
        return subprocess.Popen(command, env=os.environ | variables, stdin=subprocess.PIPE)

    monkeypatch.setattr(kernel_compilation, "_start_compilation_process", start_compilation_process)
    with compile_in_background():
        must_interpret = compiled._must_interpret
        assert must_interpret is not None
        interpreted: list[str] = []

        def record(kernel: str, arguments: tuple[Any, ...]) -> bool:
            is_interpreted = must_interpret(kernel, arguments)
            if is_interpreted:
                interpreted.append(kernel)
            return is_interpreted

        interpret_kernels(record)
        simulation.step()
        assert NET_FORCES in interpreted

        def runs_as_machine_code() -> bool:
            interpreted.clear()
            simulation.step()
            return NET_FORCES not in interpreted

        wait_until(runs_as_machine_code)
        assert interpreted, "the other kernels are not compiled yet"
    assert not is_interpreting()


SCRIPT = """
import subprocess, time
from robocov import kernel_compilation
started = []
class Recorded(subprocess.Popen):
    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        print(self.pid, flush=True)
subprocess.Popen = Recorded
with kernel_compilation.compile_in_background():
    time.sleep(600)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kill -9 is of POSIX")
def test_background_process_ends_with_a_killed_program(tmp_path: Path) -> None:
    variables = {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT / "coverage")}
    program = subprocess.Popen(
        [sys.executable, "-c", SCRIPT], env=os.environ | variables, stdout=subprocess.PIPE, text=True
    )
    assert program.stdout is not None
    with program:
        background = int(program.stdout.readline())
        program.send_signal(signal.SIGKILL)

    def has_ended() -> bool:
        try:
            os.kill(background, 0)
        except ProcessLookupError:
            return True
        return Path(f"/proc/{background}/stat").read_text().split()[2] == "Z"

    wait_until(has_ended)
