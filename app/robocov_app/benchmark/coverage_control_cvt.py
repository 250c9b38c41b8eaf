"""Controllers of CoverageControl, computed by its own library, for the track ``open-square``.

CoverageControl (Agarwal et al. 2024, LPAC) is another simulator of coverage control, see
`robocov_app.benchmark.maps.worlds`. At each of its decisions, its library receives the positions of all
robots and returns their velocities, which the robots track.

The benchmark passes this file to its runs like a user's controller, because these controllers cannot run
separately for each robot: the library computes the velocities of all robots at once, and simulates sensing
and communication itself. It therefore needs the true density, which is hidden from all other controllers on
this track. The peaks of the density are in the extra content of the map, under `PEAKS_KEY`: a list of
``[x, y, sigma, mass]``. The library decides how much of it each robot uses. A verification can repeat the
runs, but cannot check what individual robots know.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from robocov.controllers.base import is_plan_due
from robocov.controllers.driving import compute_drive_forces
from robocov.controllers.gains import response_time_gain
from robocov.controllers.known_map import WholeMapController
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray

PEAKS_KEY = "coverage_control"
"""Key of the peaks in the extra content of a map."""
LIBRARY = "coverage_control"
"""Name of the package of CoverageControl."""


def load_library() -> Any:
    """Load the compiled part of CoverageControl, which contains the simulator and its controllers.

    Its Python package imports PyTorch Geometric, which this part does not need. An empty package with the
    same search path therefore takes its place in this process, and the extension module ``_core`` is
    imported directly: the package exports its classes under no other name.

    Returns
    -------
    module

    Raises
    ------
    ParameterError
        If CoverageControl is not installed.
    """
    if LIBRARY not in sys.modules:
        spec = importlib.util.find_spec(LIBRARY)
        if spec is None or spec.submodule_search_locations is None:
            raise ParameterError(
                'CoverageControl is not installed: pip install "robocov[coverage-control]" '
                "(only on Linux with an x86-64 processor, and Python up to 3.13)"
            )
        package = ModuleType(LIBRARY)
        package.__path__ = list(spec.submodule_search_locations)
        sys.modules[LIBRARY] = package
    return importlib.import_module(f"{LIBRARY}._core")


def build_world_density(library: Any, parameters: Any, peaks: Any) -> Any:
    """Build the density of a world in CoverageControl.

    Parameters
    ----------
    library : module
        As returned by `load_library`.
    parameters : object
        Parameters of the library.
    peaks : sequence of (x, y, sigma, mass)
        Center and standard deviation of each Gaussian, m, and its integral before truncation.

    Returns
    -------
    object
        A ``WorldIDF`` of the library.
    """
    world_density = library.WorldIDF(parameters)
    for x, y, sigma, mass in peaks:
        world_density.AddNormalDistribution(
            library.BivariateNormalDistribution(np.array([x, y]), sigma, mass)
        )
    world_density.GenerateMap()
    return world_density


class LibraryRun:
    """A run in the library: its maps of what has been sensed, and the controller that reads them.

    The state of the library depends only on the positions that it has received. If these are not the
    beginning of the history, for example because the simulation was rewound, the run is restarted and the
    history is replayed.

    Parameters
    ----------
    algorithm : str
        Name of the controller in the library.
    peaks : sequence of (x, y, sigma, mass)
        As for `build_world_density`.
    """

    def __init__(self, algorithm: str, peaks: Any) -> None:
        self._library = load_library()
        self._algorithm = algorithm
        self._peaks = peaks
        self._received: FloatArray | None = None
        """Positions that the library has received, (k, n, 2) m; None before the start."""
        self._system: Any = None
        """``CoverageSystem`` of the library; None before the start."""
        self._controller: Any = None
        """Controller of the library; None before the start."""

    def decide(self, history: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the velocities and goals for the last positions of a history.

        Parameters
        ----------
        history : (k, n, 2) array, m
            Positions of the robots at all decisions so far, including this one.

        Returns
        -------
        velocities : (n, 2) array, m/s
        goals : (n, 2) array, m
        """
        # Restart unless the history continues the positions that the library has already received.
        if self._received is None or not np.array_equal(self._received, history[: len(self._received)]):
            self._start(history[0])
            self._received = history[:1]
        for positions in history[len(self._received) :]:
            self._system.SetGlobalRobotPositions(self._library.PointVector(list(positions)))
        self._received = history
        # If the history has not changed, the result is the same as before, because it depends only on the
        # state of the system.
        self._controller.ComputeActions()
        velocities = np.array(list(self._controller.GetActions()), dtype=float).reshape(-1, 2)
        goals = np.array(list(self._controller.GetGoals()), dtype=float).reshape(-1, 2)
        return velocities, goals

    def _start(self, starts: FloatArray) -> None:
        """Build the world, and a team at the given starting positions, (n, 2) m."""
        parameters = self._library.Parameters()
        world_density = build_world_density(self._library, parameters, self._peaks)
        self._system = self._library.CoverageSystem(
            parameters, world_density, self._library.PointVector(list(starts))
        )
        algorithm = getattr(self._library, self._algorithm)
        self._controller = algorithm(parameters, len(starts), self._system)


@lru_cache(maxsize=1)
def _get_library_run(algorithm: str, environment: Environment) -> LibraryRun:
    """Return the run of a controller in the library; the latest run is kept in memory."""
    return LibraryRun(algorithm, environment.extra[PEAKS_KEY])


@dataclass(frozen=True, eq=False)
class LibraryMemory:
    """Memory of n robots: what the library has received, and what it has returned."""

    team: Team
    period: float
    """Time between two decisions of the library, s."""
    history: FloatArray
    """Positions at all decisions so far, (k, n, 2) m."""
    velocities: FloatArray
    """Velocities that the last decision returned, (n, 2) m/s."""
    goals: FloatArray
    """Goals of the last decision, (n, 2) m."""
    decision_time: float = -np.inf
    """Time of the last decision, s."""


@dataclass(frozen=True)
class LibraryController(WholeMapController):
    """Base class of controllers that query the library once in each of its time steps.

    In CoverageControl, a robot moves at exactly the returned velocity until the next step. Here, forces track
    this velocity with the time constant `response_time`, up to the maximum acceleration.
    """

    algorithm: ClassVar[str]
    """Name of the controller in the library."""

    response_time: float = response_time_gain()

    def __post_init__(self) -> None:
        """Check the gains; raise ParameterError if CoverageControl is not installed."""
        super().__post_init__()
        load_library()

    def begin(self, region: Region, team: Team) -> LibraryMemory:
        """Return the memory before the first decision; raise ParameterError if the map has no peaks."""
        if PEAKS_KEY not in self.get_environment().extra:
            raise ParameterError(
                f"controller {self.name!r}: expected a map with the peaks of its density under "
                f"{PEAKS_KEY!r}, got none: robocov benchmark --controller {self.name} adds them"
            )
        robots = len(team)
        return LibraryMemory(
            team,
            period=float(load_library().Parameters().pTimeStep),
            history=np.empty((0, robots, 2)),
            velocities=np.zeros((robots, 2)),
            goals=np.full((robots, 2), np.nan),
        )

    def decide(self, seen: Observations, memory: LibraryMemory) -> Decision:
        """Compute the forces that track the velocities last returned by the library."""
        if is_plan_due(memory.decision_time, memory.period, seen.time):
            history = np.concatenate([memory.history, seen.positions[None]])
            velocities, goals = _get_library_run(self.algorithm, self.get_environment()).decide(history)
            memory = replace(
                memory, history=history, velocities=velocities, goals=goals, decision_time=seen.time
            )
        forces = compute_drive_forces(memory.velocities, seen, memory.team, self.response_time)
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory)


@dataclass(frozen=True)
class ClairvoyantCvt(LibraryController):
    """Lloyd's algorithm with the true density and the positions of all robots."""

    name = "coverage-control-clairvoyant"
    label = "Clairvoyant CVT"
    summary = "Lloyd's algorithm of CoverageControl with the true density and all positions"
    algorithm = "ClairvoyantCVT"


@dataclass(frozen=True)
class CentralizedCvt(LibraryController):
    """Lloyd's algorithm with what the whole team has sensed, and the positions of all robots."""

    name = "coverage-control-centralized"
    label = "Centralized CVT"
    summary = "Lloyd's algorithm of CoverageControl with what the whole team has sensed, and all positions"
    algorithm = "CentralizedCVT"


@dataclass(frozen=True)
class DecentralizedCvt(LibraryController):
    """Lloyd's algorithm with what each robot has sensed, and the positions in communication range."""

    name = "coverage-control-decentralized"
    label = "Decentralized CVT"
    summary = "Lloyd's algorithm of CoverageControl with what each robot has sensed, and positions in range"
    algorithm = "DecentralizedCVT"
