"""One step of a simulation: the state, the observations and the decision."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robocov.errors import format_count
from robocov.observation.decisions import Decision
from robocov.observation.observations import Observations
from robocov.typing import BoolArray, FloatArray


@dataclass(slots=True, eq=False)
class Snapshot:
    """The state of a simulation at one time, with the observations and the decision.

    Attributes
    ----------
    seen : Observations
        Observations of the robots.
    decision : Decision
        Decision of the controller for these observations.
    true_positions : (n, 2) array or None, m
        The true positions, if the observed ones may differ from them. None: the observed positions are
        exact.
    is_working : (n,) bool array or None
        Mask of the robots that have joined and have not failed. None: all.
    inbox : object
        The messages that the robots have received so far; None if communication is ideal.
    sent_bytes : int
        Total size of the controller messages that the robots have sent before this step.

    See Also
    --------
    Simulation.observe_and_decide : The snapshot of the current step.
    Simulation.snapshots : One snapshot after another.
    Record : All steps of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> simulation = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0))
    >>> for snapshot in simulation.snapshots(0.05):
    ...     print(snapshot)
    <Snapshot at 0.00 s, 3 robots>
    <Snapshot at 0.02 s, 3 robots>
    <Snapshot at 0.03 s, 3 robots>
    <Snapshot at 0.05 s, 3 robots>
    """

    seen: Observations
    decision: Decision
    true_positions: FloatArray | None = None
    is_working: BoolArray | None = None
    inbox: Any = None
    sent_bytes: int = 0

    def __repr__(self) -> str:
        return f"<Snapshot at {self.time:.2f} s, {format_count(len(self.positions), 'robot')}>"

    @property
    def time(self) -> float:
        """Simulation time, s."""
        return self.seen.time

    @property
    def positions(self) -> FloatArray:
        """True positions of the robots, (n, 2) m."""
        return self.seen.positions if self.true_positions is None else self.true_positions

    @property
    def velocities(self) -> FloatArray:
        """Velocities, (n, 2) m/s."""
        return self.seen.velocities

    @property
    def steering(self) -> FloatArray | None:
        """Heading and turning rate of unicycles, (n, 2) rad and rad/s; None in a team of points."""
        return self.seen.steering
