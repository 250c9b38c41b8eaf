"""Recorded states of a run, from which it can be resumed bit for bit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

from robocov.arrays import Array
from robocov.conditions import Conditions
from robocov.conditions.communication import Inbox
from robocov.environment import CircleObstacle, Environment, Point
from robocov.observation import Decision
from robocov.team import Team
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario


@dataclass(frozen=True, eq=False)
class PaneSetup:
    """Map, controller and robots of a pane, which change only by edits.

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
        Noise and message loss, without robots that fail or join.
    """

    environment: Environment
    controller: ControllerChoice
    properties: RobotProperties
    numbers: tuple[int, ...]
    failed: Mapping[int, Point]
    conditions: Conditions | None = None

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
    def speed_limits(self) -> Array | None:
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
    """

    setup: PaneSetup
    positions: Array
    velocities: Array
    memory: Any
    recorded: Decision | None = None
    inbox: Inbox | None = None
    steering: Array | None = None


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
