"""The learned controller: a small neural network chooses where each robot goes next.

The network imitates a planner that knows the map (`LocalSearch`), but its inputs contain only what a robot
knows itself. `tests/bench/train_policy.py` trains it.

Like the oracle, this controller is not in the registry of controllers. The registry is in `robocov`, which
cannot import the observations of `robocov_app.learning`, and the paper's study runs all controllers in it.
The benchmark passes this file to its runs like that of a user. Other commands accept the path of this file,
followed by ``:Learned``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from robocov.controllers.base import BaseController
from robocov.controllers.driving import update_returns
from robocov.controllers.exploration.route_following import RouteGains, RouteProgress, follow_routes
from robocov.controllers.gains import gain, response_time_gain
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import Float32Array, FloatArray
from robocov_app.learning import ObservationLayout
from robocov_app.learning.policy_network import apply_layer, evaluate_network, load_network

LAYOUT = ObservationLayout(neighbors=8, rays=64, centroid=True)
"""Layout of the observations, the first part of the inputs of the network."""
DECISION_PERIOD_S = 0.25
"""Time between two decisions of the network."""
TRAIL_TIMES_S = (2.0, 8.0, 30.0)
"""Time constants of the moving averages of a robot's own positions, which show where it has come from."""
MAX_OFFSET_M = 1.0
"""Maximum distance of the goal from the robot: the network chooses a direction rather than a final goal."""
DIRECTIONS = 32
"""Number of directions from which the network chooses."""
FULL_ALIGNMENT = 2 / 3
"""Alignment of the chosen direction from which robots do not shorten the offset; see `to_offsets`."""
INPUT_SIZE = LAYOUT.size + 1 + 2 * len(TRAIL_TIMES_S)
"""Number of inputs of the network."""
OUTPUT_SIZE = DIRECTIONS + 1
"""Number of outputs of the network: a preference for each direction, and the distance of the goal."""


@dataclass(frozen=True, slots=True, eq=False)
class LearnedMemory:
    """Memory of n robots. Row i belongs to robot i alone."""

    team: Team
    trail_means: FloatArray | None = None
    """(n, 3, 2) m, moving averages of the positions, with the time constants `TRAIL_TIMES_S`."""
    goals: FloatArray | None = None
    """(n, 2) m"""
    returns: FloatArray | None = None
    """(n, rays, 2) m, obstacle points in the last scan; nan for none."""

    def update(self, seen: Observations) -> LearnedMemory:
        """Return the memory after a step: with a new scan, robots also note their positions."""
        returns = update_returns(seen, self.returns)
        trail_means = self.trail_means
        if seen.scans is not None:
            positions = seen.positions[:, None]
            if trail_means is None:
                trail_means = np.repeat(positions, len(TRAIL_TIMES_S), axis=1)
            fractions = DECISION_PERIOD_S / np.array(TRAIL_TIMES_S)
            trail_means = trail_means + fractions[:, None] * (positions - trail_means)
        return replace(self, returns=returns, trail_means=trail_means)


def build_inputs(seen: Observations, memory: LearnedMemory) -> Float32Array:
    """Build the inputs of the network: each row contains only what the robot knows itself.

    Parameters
    ----------
    seen : Observations
        Observations with scans.
    memory : LearnedMemory
        Memory after this step.

    Returns
    -------
    (n, INPUT_SIZE) array
        The observation row of `LAYOUT`; the sensing range, relative to the diameter of the region; and the
        offsets of the averages of the trail, relative to the sensing range. All numbers are from -1 to 1.
    """
    team = memory.team
    assert memory.trail_means is not None
    sensing_range = np.minimum(team.sensing_range, seen.region.diameter)
    trail_offsets = (memory.trail_means - seen.positions[:, None]) / sensing_range[:, None, None]
    inputs = np.empty((len(seen.positions), INPUT_SIZE), dtype=np.float32)
    inputs[:, : LAYOUT.size] = LAYOUT.build_rows(seen, team)
    inputs[:, LAYOUT.size] = sensing_range / seen.region.diameter
    inputs[:, LAYOUT.size + 1 :] = np.clip(trail_offsets, -1.0, 1.0).reshape(len(inputs), -1)
    return inputs


def to_offsets(outputs: FloatArray) -> FloatArray:
    """Convert outputs of the network to the offsets of the goals.

    Parameters
    ----------
    outputs : (n, OUTPUT_SIZE) array

    Returns
    -------
    (n, 2) array, m
        Offsets of at most `MAX_OFFSET_M`.

    Notes
    -----
    The preferences are the logarithms of the probabilities p of the directions, up to a constant. The
    alignment of a direction d is the sum of p_k max(0, cos(d - k))² over all directions k. The offset has the
    direction with the largest alignment. It is shorter if this alignment is below `FULL_ALIGNMENT`, so that
    robots that do not know where to go move slowly.
    """
    preferences = outputs[:, :DIRECTIONS]
    likelihoods = np.exp(preferences - preferences.max(axis=1, keepdims=True))
    # The last bits of exponentials depend on the processor. Rounding makes results the same everywhere.
    likelihoods = likelihoods.round(9)
    directions, products = _compute_directions()
    probabilities = likelihoods / likelihoods.sum(axis=1, keepdims=True)
    alignments = apply_layer(products, np.zeros(DIRECTIONS, dtype=np.float32), probabilities)
    lengths = np.clip(outputs[:, DIRECTIONS], 0.0, MAX_OFFSET_M)
    lengths *= np.minimum(alignments.max(axis=1) / FULL_ALIGNMENT, 1.0)
    return np.asarray(directions[alignments.argmax(axis=1)] * lengths[:, None])


@cache
def _compute_directions() -> tuple[FloatArray, Float32Array]:
    """Return the unit vectors of all directions, and max(0, cos)² of the angles between each two of them."""
    angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    directions = np.column_stack([np.cos(angles), np.sin(angles)]).round(9)
    cosines = np.cos(angles[:, None] - angles).round(9)
    return directions, (np.maximum(cosines, 0.0) ** 2).astype(np.float32)


@dataclass(frozen=True)
class Learned(BaseController):
    """A neural network chooses where each robot goes; the robot avoids collisions on its way.

    Four times per second, the network maps what a robot knows to a goal at most 1 m away from it: its
    position and velocity, the offsets of its eight nearest neighbors, a scan of 64 rays, the centroid of its
    Voronoi cell, and averages of its own positions over the last seconds. The robot moves to the goal and
    keeps away from walls and other robots as all controllers with routes do; see `follow_routes`.

    Notes
    -----
    The network was trained by imitation (DAgger: Ross, Gordon and Bagnell 2011). While robots follow the
    network on generated maps, `LocalSearch`, which knows these maps, determines where each robot should go.
    The network learns to predict this from what the robot itself knows. CoverageControl's learned controller
    (LPAC: Agarwal et al. 2024) imitates a clairvoyant controller, too.
    """

    name = "learned"
    label = "Learned policy"
    summary = "a neural network that imitates a planner with the whole map"
    scanning = Scanning(rays=LAYOUT.rays, period=DECISION_PERIOD_S)

    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> LearnedMemory:
        """Return the memory before the first decision."""
        return LearnedMemory(team)

    def decide(self, seen: Observations, memory: LearnedMemory) -> Decision:
        """Compute the forces that drive the robots to their goals, which are chosen after each scan."""
        memory = memory.update(seen)
        if seen.scans is not None:
            outputs = evaluate_network(load_network(), build_inputs(seen, memory))
            memory = replace(memory, goals=seen.positions + to_offsets(outputs))
        return self.drive(seen, memory)

    def drive(self, seen: Observations, memory: LearnedMemory) -> Decision:
        """Compute the forces that drive the robots to the goals in their memory without collisions.

        Parameters
        ----------
        seen : Observations
        memory : LearnedMemory
            Memory with goals.

        Returns
        -------
        Decision
        """
        assert memory.goals is not None
        # A route consists of the goal alone, which is at most 1 m away.
        progress = RouteProgress(
            routes=tuple(memory.goals[:, None]),
            waypoint_indices=np.zeros(len(memory.goals), dtype=np.intp),
        )
        gains = RouteGains(self.k_prop, self.response_time)
        command = follow_routes(seen, memory.team, progress, memory.returns, gains)
        terms = {"attraction": command.forces}
        return Decision(command.forces, command.goals, terms, memory=memory)
