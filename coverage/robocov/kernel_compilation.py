"""Compilation of kernels in advance: before a long computation, or in the background of a window.

Numba compiles a kernel for the types of the arguments with which it is called. Each *example* below calls a
group of kernels as robocov does. After the call, the machine code of these kernels is in the cache folder,
and a file there marks the example as ready. No two processes call the same example at the same time.

``python -m robocov.kernel_compilation`` calls all examples.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from filelock import FileLock

from robocov.compiled import (
    describe_argument_types,
    import_numba,
    interpret_kernels,
    list_compiled_kernels,
    open_cache_folder,
)
from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, Lloyd, Rapf
from robocov.cost import CoverageCost
from robocov.density import Density, Gaussian, Gaussians, Raster, WeightedArea, WeightedPolygons
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.files.writing import replace_file
from robocov.geodesic import Geodesics
from robocov.metrics import compute_cost_history, summarize
from robocov.observation.region import Region
from robocov.planning import raster as planning_raster
from robocov.planning.discovered_map import FREE, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.window import Window
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import FloatArray

Example: TypeAlias = Callable[[], None]
"""A function that calls kernels in order to compile them."""

_COMPILED_LIST = "compiled.json"
"""File in the cache folder with the names of the kernels whose machine code is there, and their types."""
_POLL_PERIOD_S = 0.25
"""Time between two checks for further compiled kernels."""
_EXIT_WITH_PARENT_OPTION = "--until-stdin-closes"
"""Command-line option: exit when standard input closes, as it does when the parent process ends."""
CONTROLLER_STEPS = 12
"""Number of steps after which each built-in controller has planned a route."""
_SQUARE = ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0))
_TRIANGLE = PolygonObstacle(((3.0, 3.0), (4.0, 3.0), (4.0, 4.0)))
_MAP = Environment("example", _SQUARE, (_TRIANGLE,))
"""Map of most examples."""
_WALL = WallObstacle(((3.0, 0.0), (3.0, 5.0)), 0.2)
_DIVIDED_MAP = Environment("divided example", _SQUARE, (_WALL, _TRIANGLE))
"""Map on which paths to the other side of the wall have a corner."""
_FORCES_INTO_WALL_N = np.full((4, 2), -1000.0)
"""Forces that push four robots against the boundary."""


def call_cost_kernels() -> None:
    """Call the kernels of the coverage cost, for equal and for different speeds."""
    cost = CoverageCost(_MAP, 2)
    cost(np.array([[0.5, 0.5]]))
    cost(np.array([[0.5, 0.5], [5.0, 5.0]]), speeds=np.array([1.0, 2.0]))


def call_step_kernels() -> None:
    """Call the kernels of a step with the controllers of the paper, without and with contacts."""
    for controller in (Rapf(), Lloyd()):
        simulation = Simulation(_MAP, controller, _place_robots(4))
        simulation.step()
        simulation.step(_FORCES_INTO_WALL_N)
        simulation.step()


def call_summary_kernels() -> None:
    """Call the kernels of the metrics of a run."""
    record = Simulation(_MAP, Rapf(), _place_robots(2)).run(0.1)
    summarize(record, compute_cost_history(record, CoverageCost(_MAP, 2)))


def call_large_team_kernels() -> None:
    """Call the kernels of large teams, whose Voronoi cells are computed from a triangulation."""
    simulation = Simulation(_MAP, Rapf(), _place_robots(25))
    for _ in range(3):
        simulation.step()


def call_team_kernels() -> None:
    """Call the kernels of unicycles, limited communication, message loss, and cells by travel time."""
    unicycles = Team.homogeneous(4, kinematics="unicycle", communication_range=3.0)
    mixed_speeds = replace(Team.homogeneous(4), max_speed=np.array([1.0, 0.5, 1.0, 2.0]))
    lossy = Conditions(loss=0.1)
    for team, controller, conditions in (
        (unicycles, Rapf(), None),
        (mixed_speeds, Rapf(cells="time"), None),
        (Team.homogeneous(4), Rapf(), lossy),
    ):
        simulation = Simulation(_MAP, controller, _place_robots(4), team, conditions=conditions)
        simulation.step()
        simulation.step(_FORCES_INTO_WALL_N)
        simulation.step()


def call_density_kernels() -> None:
    """Call the kernels of all kinds of density."""
    densities: Sequence[Density] = (
        Gaussians((Gaussian((2.0, 2.0), weight=5.0, sigma=1.0),), floor=1.0),
        WeightedPolygons((WeightedArea(((1.0, 1.0), (2.0, 1.0), (2.0, 2.0)), weight=3.0),), background=1.0),
        Raster(np.array([[1.0, 2.0], [3.0, 4.0]]), extent=(0.0, 0.0, 6.0, 6.0)),
    )
    for density in densities:
        environment = replace(_MAP, density=density)
        simulation = Simulation(environment, Rapf(), _place_robots(4))
        simulation.step()
        CoverageCost(environment, 2)(simulation.positions)


def call_path_kernels() -> None:
    """Call the kernels of shortest paths."""
    path = Geodesics(_DIVIDED_MAP).find_path(np.array([0.5, 0.5]), np.array([5.0, 0.5]))
    assert len(path) > 2, "expected a path around the end of the wall, got a straight one"


def call_controller_kernels() -> None:
    """Call the kernels of all built-in controllers, on a map with a wall around which they plan routes."""
    for controller in CONTROLLERS.values():
        simulation = Simulation(_DIVIDED_MAP, controller(), _place_robots(4))
        for _ in range(CONTROLLER_STEPS):
            simulation.step()


def call_planning_kernels() -> None:
    """Call the kernels of routes around walls, including those for large maps."""
    raster = planning_raster.Raster(Region(np.array(_SQUARE)), cell_size=0.1)
    state = np.full(raster.shape, FREE, dtype=np.uint8)
    # A wall with a gap of 0.3 m, wide enough for the clearance.
    state[:34, 30] = WALL
    state[37:, 30] = WALL
    # With so few nodes, the stride is above 1, as on a large map.
    middle = np.array([3.0, 3.0])
    window = Window.build_around(raster, middle, half_width=math.inf, max_nodes=16)
    planner = GridPlanner(DiscoveredMap(raster, state), window, clearance=0.13)
    goal = np.array([5.0, 1.0])
    planner.find_route(np.array([1.0, 1.0]), goal)
    # Numba compiles again for read-only arrays, such as the positions in observations.
    observed_position = np.array([1.0, 2.0])
    observed_position.setflags(write=False)
    planner.find_route(observed_position, goal)


COMMON_EXAMPLES: tuple[Example, ...] = (call_cost_kernels, call_step_kernels, call_summary_kernels)
"""Examples for a run of the controllers of the paper, and its summary."""
ALL_EXAMPLES: tuple[Example, ...] = (
    call_step_kernels,
    call_cost_kernels,
    call_summary_kernels,
    call_large_team_kernels,
    call_team_kernels,
    call_density_kernels,
    call_path_kernels,
    call_controller_kernels,
    call_planning_kernels,
)
"""Examples for all kernels."""


def _place_robots(robot_count: int) -> FloatArray:
    """Return positions of robots on a grid, the first one in a corner of the map."""
    robots = np.arange(robot_count)
    return np.column_stack([0.3 + 0.5 * (robots % 5), 0.3 + 0.5 * (robots // 5)])


def compile_kernels(examples: Sequence[Example] = COMMON_EXAMPLES) -> None:
    """Compile the kernels that examples call, unless their machine code is already in the cache.

    An example calls a group of kernels with arguments of the same types as in a simulation. Numba compiles a
    kernel at its first call, so that calling the example compiles the group. If another process is calling
    the example, this function waits for the other process. Without a cache folder, only this process can use
    the machine code.

    Parameters
    ----------
    examples : sequence of Example
        Examples to call; by default, those for a run and its summary.
    """
    folder = open_cache_folder()
    for example in examples:
        if folder is None:
            example()
        elif not _get_marker(folder, example).exists():
            with FileLock(folder / f"{example.__name__}.lock"):
                if not _get_marker(folder, example).exists():
                    example()
                    _get_marker(folder, example).touch()
                    _save_compiled_list(folder)


def are_kernels_compiled(examples: Sequence[Example] = COMMON_EXAMPLES) -> bool:
    """Return whether the machine code of the kernels that examples call is in the cache.

    Parameters
    ----------
    examples : sequence of Example
        Examples to check; by default, those for a run and its summary.

    Returns
    -------
    bool
        Whether all examples are ready.
    """
    folder = open_cache_folder()
    return folder is not None and all(_get_marker(folder, example).exists() for example in examples)


@contextmanager
def compile_in_background() -> Iterator[None]:
    """Compile all kernels in another process, and run kernels as Python until they are compiled.

    The results are the same. A step of six robots in Python takes less than a millisecond, so that a window
    can show a simulation in real time from the start. At the end of the ``with`` block, the other process is
    ended. Kernels that it has not compiled are compiled the next time.

    Returns
    -------
    context manager
        Context without a value.
    """
    folder = open_cache_folder()
    if folder is None or are_kernels_compiled(ALL_EXAMPLES):
        yield
        return
    global _background_compilation
    compilation = _background_compilation = _BackgroundCompilation(folder)
    interpret_kernels(compilation.must_interpret)
    try:
        yield
    finally:
        interpret_kernels(None)
        _background_compilation = None
        compilation.close()


def is_compiling_in_background() -> bool:
    """Return whether another process is compiling kernels, so that some of them run as Python and are slow.

    Returns
    -------
    bool
        Whether the process that `compile_in_background` has started is still running.
    """
    return _background_compilation is not None and not _background_compilation.has_ended


class _BackgroundCompilation:
    """Another process that compiles all kernels.

    Parameters
    ----------
    folder : Path
        Cache folder.
    """

    def __init__(self, folder: Path) -> None:
        self._list_file = folder / _COMPILED_LIST
        self._compiled: dict[str, list[str]] = {}
        self._next_poll_time = 0.0
        # Importing numba is slow too. A thread of this process does it meanwhile.
        self._import = threading.Thread(target=import_numba, daemon=True)
        self._import.start()
        self._process = _start_compilation_process()

    @property
    def has_ended(self) -> bool:
        """Whether the process has compiled all kernels, or has failed."""
        return self._process is None or self._process.poll() is not None

    def must_interpret(self, kernel: str, arguments: tuple[Any, ...]) -> bool:
        """Return whether a kernel must run as Python because its machine code is not ready."""
        if self._import.is_alive():
            return True
        if self._is_compiled(kernel, arguments):
            return False
        if time.monotonic() < self._next_poll_time:
            return True
        self._next_poll_time = time.monotonic() + _POLL_PERIOD_S
        self._poll()
        return not self._is_compiled(kernel, arguments)

    def _is_compiled(self, kernel: str, arguments: tuple[Any, ...]) -> bool:
        """Return whether there is machine code of a kernel for the types of its arguments."""
        if kernel not in self._compiled:
            return False
        return describe_argument_types(arguments) in self._compiled[kernel]

    def _poll(self) -> None:
        """Read which kernels have been compiled."""
        # This is determined before the list is read, because the process completes the list before it ends.
        has_ended = self.has_ended
        # There may be no list yet.
        with suppress(OSError, ValueError):
            self._compiled = json.loads(self._list_file.read_text(encoding="utf-8"))
        if has_ended:
            # No more kernels will be compiled. This process compiles the others when it calls them.
            interpret_kernels(None)

    def close(self) -> None:
        """End the other process."""
        if self._process is not None:
            with self._process:  # Leaving the block closes the pipe and waits for the end of the process.
                self._process.kill()


_background_compilation: _BackgroundCompilation | None = None
"""The other process of `compile_in_background`; None outside its ``with`` block."""


def _start_compilation_process() -> subprocess.Popen[bytes] | None:
    """Start a process that compiles all kernels; return None if the system cannot start one."""
    search_path = os.pathsep.join(filter(None, sys.path))
    with suppress(OSError):
        return subprocess.Popen(
            # -P prevents Python from importing modules from the current directory.
            [sys.executable, "-P", "-m", __name__, _EXIT_WITH_PARENT_OPTION],
            env={**os.environ, "PYTHONPATH": search_path},
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    return None


def _get_marker(folder: Path, example: Example) -> Path:
    """Return the file that exists once an example has been called."""
    return folder / f"{example.__name__}.ready"


def _save_compiled_list(folder: Path) -> None:
    """Add the kernels that this process has compiled, and their types, to the list in the cache folder."""
    path = folder / _COMPILED_LIST
    with FileLock(folder / "list.lock"):
        compiled: dict[str, list[str]] = {}
        # There may be no list yet.
        with suppress(OSError, ValueError):
            compiled = json.loads(path.read_text(encoding="utf-8"))
        for name, types in list_compiled_kernels().items():
            compiled[name] = sorted({*types, *compiled.get(name, [])})
        with replace_file(path, durable=False) as temporary:
            temporary.write_text(json.dumps(compiled, sort_keys=True), encoding="utf-8")


def main() -> None:
    """Compile all kernels at low priority."""
    if _EXIT_WITH_PARENT_OPTION in sys.argv[1:]:
        threading.Thread(target=_exit_when_stdin_closes, daemon=True).start()
    if hasattr(os, "nice"):
        os.nice(5)
    compile_kernels(ALL_EXAMPLES)


def _exit_when_stdin_closes() -> None:
    """Wait until standard input closes, then end the process."""
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main()
