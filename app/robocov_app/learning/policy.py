"""A policy as a controller: what was learned runs wherever controllers do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array
from robocov.controllers.gains import gain, validate_gains
from robocov.errors import ParameterError, shown
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.robots import Team
from robocov_app.learning.driving import Action, checked_action, driving_forces
from robocov_app.learning.layout import ObservationLayout

Policy: TypeAlias = "Callable[[NDArray[np.float32]], Any]"
"""From an observation, (size,), to an action, (2,)."""

_SOON = 5e-7
"""Seconds that sums of control periods may miss."""


@dataclass(frozen=True, eq=False)
class Held:
    """What the robots remember of their policy."""

    team: Team
    """Their limits, in which observations are told."""
    actions: Array | None = None
    """The last ones, (n, 2) N or m/s; None before the first."""
    due: float = -np.inf
    """When the next ones are, s."""


@dataclass(frozen=True)
class PolicyController:
    """A controller that does what a policy says, decided as often and observed as in training.

    The policy is asked for each robot alone, with its own row of the observations: that it uses nothing
    that the robot does not know is so by construction. For the command line a class is wanted that has the
    policy in it::

        # mine.py
        @dataclass(frozen=True)
        class MyPolicy(PolicyController):
            layout: ObservationLayout = ObservationLayout(neighbours=4)

            def act(self, observation):
                return observation @ WEIGHTS

    and ``robocov run rooms --controller mine.py:MyPolicy``.

    `policy` makes an action, (2,) in N or m/s, of an observation, (size,) float32, and is None where a
    subclass has `act`; `period` is the time for which an action is held, `CoverageTask.period` in training.

    Raises ParameterError when an attribute makes no sense, or the policy gives something else than two
    numbers.

    Examples
    --------
    >>> still = PolicyController(lambda observation: (0.0, 0.0))
    >>> still.name, still.period
    ('policy', 0.1)
    """

    name: ClassVar[str] = "policy"
    label: ClassVar[str] = "policy"
    summary: ClassVar[str] = "a policy that was learned"

    policy: Policy | None = None
    layout: ObservationLayout = field(default_factory=ObservationLayout)
    action: Action = "force"
    period: float = gain(0.1, "s", "for which an action is held")

    def __post_init__(self) -> None:
        checked_action(self.action)
        if not isinstance(self.layout, ObservationLayout):
            raise ParameterError(f"layout: {shown(self.layout)}, but an ObservationLayout was wanted")
        validate_gains(self)

    def __init_subclass__(cls) -> None:
        for attribute in ("name", "label"):
            if attribute not in vars(cls):
                setattr(cls, attribute, cls.__name__)

    @property
    def scanning(self) -> Scanning | None:
        """The scans that the observations need."""
        return Scanning(self.layout.rays, self.period) if self.layout.rays else None

    def act(self, observation: NDArray[np.float32]) -> Any:
        """Return the action of one robot, (2,), from its observation, (size,)."""
        if self.policy is None:
            raise ParameterError(f"{self.name}: a policy or a method act(observation) was wanted")
        return self.policy(observation)

    def begin(self, region: Region, team: Team) -> Held:
        """Return what is remembered before the first action."""
        return Held(team)

    def decide(self, seen: Observations, memory: Held) -> Decision:
        """Return the forces of the actions, which are asked for when they are due."""
        due = seen.time >= memory.due - _SOON if not self.layout.rays else seen.scans is not None
        if memory.actions is None or due:
            rows = self.layout.rows(seen, memory.team)
            actions = np.array([self._checked(self.act(row)) for row in rows])
            memory = Held(memory.team, actions, seen.time + self.period)
        assert memory.actions is not None
        forces = driving_forces(self.action, memory.actions, seen.velocities, memory.team)
        return Decision(forces, memory=memory)

    def _checked(self, given: Any) -> Array:
        action = np.asarray(given, dtype=np.float64)
        if action.shape != (2,):
            raise ParameterError(f"{self.name}: an action of shape {action.shape}, but (2,) was wanted")
        return action
