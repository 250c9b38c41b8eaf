"""Recorded states of a run, from which it can be resumed bit for bit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from robocov.conditions import Conditions
from robocov.conditions.communication import Inbox
from robocov.environment import CircleObstacle, Environment, Point
from robocov.observation import Decision
from robocov.simulation.team_state import TeamState
from robocov.team import Team
from robocov.typing import FloatArray, IntArray
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario


@dataclass(frozen=True, eq=False)
class PaneSetup:
    """Map, controller and robots of a pane, which change only by edits and by the conditions.

    Attributes
    ----------
    environment : Environment
        The map, without failed robots.
    controller : ControllerChoice
        The controller.
    properties : RobotProperties
        Properties of the robots.
    numbers : tuple of int
        Numbers of the working robots, in the order of the rows of arrays.
    failed : mapping of int to tuple
        Positions of failed robots by number, (x, y) m.
    conditions : Conditions or None
        Conditions of the simulation. Robots fail and join by them only if the setup follows a schedule.
    scheduled_robots : int
        Number of all robots, if the simulation lets them fail and join by its conditions: its rows are then
        the robots 1 to this number. 0 if the simulation contains the working robots alone.
    """

    environment: Environment
    controller: ControllerChoice
    properties: RobotProperties
    numbers: tuple[int, ...]
    failed: Mapping[int, Point]
    conditions: Conditions | None = None
    scheduled_robots: int = 0

    @property
    def follows_schedule(self) -> bool:
        """Whether the simulation lets robots fail and join by its conditions."""
        return self.scheduled_robots > 0

    @property
    def simulated_numbers(self) -> tuple[int, ...]:
        """Numbers of the robots of the simulation, in the order of its rows."""
        if self.follows_schedule:
            return tuple(range(1, self.scheduled_robots + 1))
        return self.numbers

    @property
    def simulated_rows(self) -> IntArray:
        """Rows of the working robots in the simulation, (n,)."""
        if self.follows_schedule:
            return np.array(self.numbers, dtype=np.intp) - 1
        return np.arange(len(self.numbers))

    @property
    def simulated_environment(self) -> Environment:
        """The map of the simulation. On a schedule, the simulation itself adds failed robots as obstacles."""
        if self.follows_schedule:
            return self.environment
        return self.sensed_environment

    @property
    def simulated_team(self) -> Team:
        """The robots of the simulation."""
        return self.properties.build_team(self.simulated_numbers)

    @property
    def constant_conditions(self) -> Conditions | None:
        """The conditions except for robots that fail or join; None without conditions."""
        if self.conditions is None:
            return None
        return self.conditions.drop_team_changes()

    def with_robots(self, numbers: tuple[int, ...], failed: Mapping[int, Point]) -> "PaneSetup":
        """Return the setup with other robots, chosen by the user; it follows no schedule any more."""
        return replace(
            self,
            numbers=numbers,
            failed=failed,
            conditions=self.constant_conditions,
            scheduled_robots=0,
        )

    @property
    def sensed_environment(self) -> Environment:
        """The map as the working robots sense it, with failed robots as obstacles."""
        if not self.failed:
            return self.environment
        radii = tuple(map(self.properties.get_radius, self.failed))
        return _add_failed_robots(self.environment, tuple(self.failed.values()), radii)

    @property
    def all_numbers(self) -> list[int]:
        """Numbers of all robots, working and failed, in ascending order."""
        return sorted([*self.numbers, *self.failed])

    @property
    def tracked_numbers(self) -> tuple[int, ...]:
        """Numbers of the robots that have a trail: the working ones, followed by the failed ones."""
        return (*self.numbers, *sorted(self.failed))

    @property
    def team(self) -> Team:
        """The working robots."""
        return self.properties.build_team(self.numbers)

    @property
    def speed_limits(self) -> FloatArray | None:
        """Maximum speeds of the working robots, (n,) m/s; None if all robots have the same."""
        if "max_speed" not in self.properties.values_by_robot:
            return None
        return self.team.max_speed


# A session has many setups, and the data computed from a map are large, so only a few maps are cached.
@lru_cache(maxsize=8)
def _add_failed_robots(
    environment: Environment, positions: tuple[Point, ...], radii: tuple[float, ...]
) -> Environment:
    failed_robots = map(CircleObstacle, positions, radii)
    return replace(environment, obstacles=(*environment.obstacles, *failed_robots))


class PaneState(NamedTuple):
    """State of one pane at one step.

    Attributes
    ----------
    setup : PaneSetup
        Map, controller and robots.
    positions, velocities : (n, 2) array, m and m/s
        Positions and velocities of the working robots.
    memory : object
        Memory of the controller; None for a controller without memory.
    recorded : Decision or None
        The recorded decision, if the state comes from a record.
    inbox : Inbox or None
        Messages that robots have received, and those in flight or waiting; None if there are none.
    steering : (n, 2) array or None, rad and rad/s
        Headings and turning rates of unicycles.
    all_robots : TeamState or None
        State of all robots of the simulation, if the setup follows a schedule.
    """

    setup: PaneSetup
    positions: FloatArray
    velocities: FloatArray
    memory: Any
    recorded: Decision | None = None
    inbox: Inbox | None = None
    steering: FloatArray | None = None
    all_robots: TeamState | None = None


class Drag(NamedTuple):
    """A robot that the user drags.

    Attributes
    ----------
    robot : int
        Number of the robot.
    target : tuple of float, m
        Point to which it is pulled.
    """

    robot: int
    target: Point


class RunState(NamedTuple):
    """State of all panes at one step.

    Attributes
    ----------
    step : int
        Number of control steps since time 0.
    states : mapping of int to PaneState
        State of each pane, by its number.
    scenario : SessionScenario
        Map, controllers and properties at this step.
    drag : Drag or None
        The dragged robot, if there is one.
    node : int
        Number of the node of the undo tree whose time span contains the step.
    """

    step: int
    states: Mapping[int, PaneState]
    scenario: SessionScenario
    drag: Drag | None = None
    node: int = 0
