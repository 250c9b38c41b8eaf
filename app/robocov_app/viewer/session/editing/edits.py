"""Edits of a session in the form in which files contain them, and their effects on a pane or the map."""

from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Annotated, Any, Literal, TypeAlias, cast

import numpy as np
from pydantic import ConfigDict, Field, WrapValidator

from robocov.density import Density
from robocov.environment import Environment, Obstacle, Point
from robocov.errors import MapError, ParameterError, RobocovError
from robocov.mapfile import parse_density, to_json
from robocov.mapfile.models import DensityModel, ObstacleModel, to_json_value
from robocov.world.free_positions import find_free_position
from robocov_app.viewer.session.editing.map_edits import paint_density, replace_obstacles
from robocov_app.viewer.session.files.fields import Position, RobotNumber, Step, build_refusal, convert_field
from robocov_app.viewer.session.pane import Continuation, Pane
from robocov_app.viewer.session.setup.controller_choice import FileController
from robocov_app.viewer.session.setup.robot_properties import FileProperties
from robocov_app.viewer.session.setup.scenario import MAX_ROBOTS, FileScenario, SessionScenario

MAX_PANE_NUMBER = 100
MAX_BRUSH_RADIUS_M = 1e6
UNDATED_STEP = -1
"""Step of an edit that has not been applied yet."""

_PaneNumber: TypeAlias = Annotated[
    int, Field(strict=True, ge=0, le=MAX_PANE_NUMBER, description="Number of a pane")
]
_Count: TypeAlias = Annotated[int, Field(strict=True, ge=0)]
_OBSTACLES = convert_field(
    list[ObstacleModel],
    load=lambda models, _: tuple(model.build() for model in models),
    dump=lambda obstacles, _: [to_json_value(obstacle) for obstacle in obstacles],
)


def _load_density(model: Any, context: Any) -> Density | None:
    if model is None:
        return None
    boundary = context.get_environment(0).boundary
    return parse_density(model.model_dump(exclude_none=True, warnings=False), boundary, context.source_name)


def _dump_density(density: Density | None, _: object) -> object:
    """Return a density as in a map file. `to_json` writes whole maps only, so a square serves as the map."""
    square = Environment("square", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), (), {})
    return to_json(square.with_density(density)).get("density")


_DENSITY = convert_field(DensityModel | None, load=_load_density, dump=_dump_density)


def _load_scenario(content: object, read: Any) -> SessionScenario:
    """Read a scenario; convert errors to validation errors, which contain a position in the file."""
    try:
        return cast(SessionScenario, read(content))
    except MapError:
        raise
    except RobocovError as error:
        raise build_refusal(error) from None


@dataclass(frozen=True, kw_only=True)
class _Edit:
    """One edit of a session.

    Attributes
    ----------
    step : int
        Step before which the edit is made.
    do : str
        Name of the kind of edit in files.
    """

    __pydantic_config__ = ConfigDict(extra="forbid", validate_default=True)

    step: Step = UNDATED_STEP
    do: str


@dataclass(frozen=True)
class RobotEdit(_Edit):
    """Edit of one robot.

    Attributes
    ----------
    robot : int
        Number of the robot.
    """

    robot: RobotNumber


@dataclass(frozen=True)
class DragRobot(RobotEdit):
    """Pull a robot toward a point by a spring.

    Attributes
    ----------
    to : tuple
        The point, (x, y) m.
    """

    to: Position
    do: Literal["drag"] = field(default="drag", kw_only=True)


@dataclass(frozen=True)
class ReleaseRobot(_Edit):
    """Stop pulling a robot, which keeps its velocity."""

    do: Literal["release"] = field(default="release", kw_only=True)


@dataclass(frozen=True)
class PlaceRobot(RobotEdit):
    """Put a robot, working or failed, at the free position nearest to a point.

    Attributes
    ----------
    at : tuple
        The requested point, (x, y) m.
    """

    at: Position
    do: Literal["place"] = field(default="place", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        row = _find_row(pane, self.robot)
        position = _find_free_position(pane, self.robot, self.at)
        if row is None:
            return _change_robot(pane, self.robot, failed_at=position)
        return _change_robot(pane, self.robot, working_at=position)


@dataclass(frozen=True)
class AddRobot(RobotEdit):
    """Add a robot, at rest, at the free position nearest to a point.

    Attributes
    ----------
    at : tuple
        The requested point, (x, y) m.
    """

    at: Position
    do: Literal["join"] = field(default="join", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        numbers = pane.setup.all_numbers
        if len(numbers) >= MAX_ROBOTS:
            raise ParameterError(f"there are {MAX_ROBOTS} robots already")
        if self.robot in numbers:
            raise ParameterError(f"robot {self.robot} already exists")
        return _change_robot(pane, self.robot, working_at=_find_free_position(pane, self.robot, self.at))


@dataclass(frozen=True)
class RemoveRobot(RobotEdit):
    """Remove a robot, working or failed."""

    do: Literal["leave"] = field(default="leave", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        _find_row(pane, self.robot)  # raises if there is no such robot
        _require_another_robot(pane, self.robot)
        return _change_robot(pane, self.robot)


@dataclass(frozen=True)
class FailRobot(RobotEdit):
    """Make a robot fail: it stops, sends no messages, and is an obstacle to the others."""

    do: Literal["fail"] = field(default="fail", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        row = _find_row(pane, self.robot)
        if row is None:
            raise ParameterError(f"robot {self.robot} has failed already")
        _require_another_robot(pane, self.robot)
        x, y = pane.positions[row].tolist()
        return _change_robot(pane, self.robot, failed_at=(x, y))


@dataclass(frozen=True)
class ReviveRobot(RobotEdit):
    """Revive a failed robot at its position or the nearest free one."""

    do: Literal["revive"] = field(default="revive", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        if _find_row(pane, self.robot) is not None:
            raise ParameterError(f"robot {self.robot} has not failed")
        failed_at = pane.setup.failed[self.robot]
        return _change_robot(pane, self.robot, working_at=_find_free_position(pane, self.robot, failed_at))


@dataclass(frozen=True)
class EditObstacles(_Edit):
    """Replace consecutive obstacles of the map by others.

    Attributes
    ----------
    first : int
        Index of the first obstacle that is replaced.
    removed : int
        Number of obstacles that are replaced.
    added : tuple of Obstacle
        The obstacles that replace them.
    """

    first: _Count
    removed: _Count
    added: Annotated[tuple[Obstacle, ...], _OBSTACLES]
    do: Literal["obstacles"] = field(default="obstacles", kw_only=True)

    def build_environment(self, environment: Environment) -> Environment:
        """Return the edited map."""
        return replace_obstacles(environment, self.first, self.removed, self.added)


@dataclass(frozen=True)
class PaintDensity(_Edit):
    """Raise or lower the density of the map with a brush.

    Attributes
    ----------
    dabs : tuple of tuple
        Points at which the brush was applied, (x, y) m each.
    radius : float, m
        Radius of the brush.
    lowers : bool
        Whether the density is lowered.
    """

    dabs: tuple[Position, ...]
    radius: Annotated[float, Field(strict=True, gt=0, le=MAX_BRUSH_RADIUS_M)]
    lowers: Annotated[bool, Field(strict=True)]
    do: Literal["paint"] = field(default="paint", kw_only=True)

    def build_environment(self, environment: Environment) -> Environment:
        """Return the edited map."""
        density = paint_density(environment, self.dabs, self.radius, lowers=self.lowers)
        return environment.with_density(density)


@dataclass(frozen=True, eq=False)
class SetDensity(_Edit):
    """Replace the density of the map.

    Attributes
    ----------
    density : Density or None
        The density; None for a uniform one.
    """

    density: Annotated[Density | None, _DENSITY]
    do: Literal["density"] = field(default="density", kw_only=True)

    def build_environment(self, environment: Environment) -> Environment:
        """Return the edited map."""
        return environment.with_density(self.density)


@dataclass(frozen=True)
class SetController(_Edit):
    """Replace the controller of a pane, or its gains.

    Attributes
    ----------
    pane : int
        Number of the pane.
    controller : ControllerChoice
        The controller.
    """

    pane: _PaneNumber
    controller: FileController
    do: Literal["controller"] = field(default="controller", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        if pane.number != self.pane:
            return Continuation(pane.setup)
        return Continuation(replace(pane.setup, controller=self.controller))


@dataclass(frozen=True)
class SetRobotProperties(_Edit):
    """Replace the properties of all robots.

    Attributes
    ----------
    properties : RobotProperties
        The properties.
    """

    properties: Annotated[FileProperties, Field(alias="team", description="The properties")]
    do: Literal["team"] = field(default="team", kw_only=True)

    def build_continuation(self, pane: Pane) -> Continuation:
        """Return the setup and state with which a pane continues after the edit."""
        return Continuation(replace(pane.setup, properties=self.properties))


@dataclass(frozen=True)
class RemovePane(_Edit):
    """Remove a pane.

    Attributes
    ----------
    pane : int
        Number of the pane.
    """

    pane: _PaneNumber
    do: Literal["remove-pane"] = field(default="remove-pane", kw_only=True)


@dataclass(frozen=True, eq=False)
class Restart(_Edit):
    """Start again at time 0; this is also the first edit of every session.

    Attributes
    ----------
    scenario : SessionScenario
        Map, robots and controllers at time 0.
    """

    scenario: Annotated[FileScenario, WrapValidator(_load_scenario)]
    do: Literal["restart"] = field(default="restart", kw_only=True)


MapEdit: TypeAlias = EditObstacles | PaintDensity | SetDensity
PaneEdit: TypeAlias = (
    PlaceRobot | AddRobot | RemoveRobot | FailRobot | ReviveRobot | SetController | SetRobotProperties
)
RunEdit: TypeAlias = PaneEdit | MapEdit | DragRobot | ReleaseRobot | RemovePane
"""Edit of a run that continues from the same step."""
SessionEdit: TypeAlias = RunEdit | Restart


def compare_obstacles(before: Environment, after: Environment) -> EditObstacles:
    """Return the edit that replaces the obstacles of one map with those of another.

    It leaves out the obstacles at the beginning and at the end that are the same in both.
    """
    old = before.obstacles
    new = after.obstacles
    equal_at_start = _count_equal(old, new)
    equal_at_end = _count_equal(old[equal_at_start:][::-1], new[equal_at_start:][::-1])
    removed = len(old) - equal_at_start - equal_at_end
    return EditObstacles(equal_at_start, removed, new[equal_at_start : len(new) - equal_at_end])


def _count_equal(old: tuple[Obstacle, ...], new: tuple[Obstacle, ...]) -> int:
    """Return the number of equal obstacles at the beginning."""
    equal_pairs = takewhile(lambda pair: pair[0] == pair[1], zip(old, new, strict=False))
    return sum(1 for _ in equal_pairs)


def _find_row(pane: Pane, number: int) -> int | None:
    """Return the row of a robot in arrays; None if it has failed; raise a ParameterError if unknown."""
    if number not in pane.setup.all_numbers:
        raise ParameterError(f"there is no robot {number}")
    return pane.get_row(number)


def _require_another_robot(pane: Pane, number: int) -> None:
    """Raise a ParameterError if a robot is the last working one."""
    if not set(pane.numbers) - {number}:
        raise ParameterError("cannot remove the last working robot")


def _find_free_position(pane: Pane, number: int, point: Point) -> Point:
    """Return the free position nearest to a point, where a robot overlaps no obstacle and no other robot."""
    setup = pane.setup
    other_rows = [row for row, other in enumerate(pane.numbers) if other != number]
    other_failed = {other: position for other, position in setup.failed.items() if other != number}
    return find_free_position(
        replace(setup, failed=other_failed).sensed_environment,
        setup.properties.get_radius(number),
        pane.positions[other_rows],
        point,
        pane.team.radius[other_rows],
    )


def _change_robot(
    pane: Pane, number: int, working_at: Point | None = None, failed_at: Point | None = None
) -> Continuation:
    """Return the setup and state of a pane after one robot has changed.

    Parameters
    ----------
    pane : Pane
        The pane.
    number : int
        Number of the robot.
    working_at : (x, y), m, optional
        Position at which the robot works from now on, initially at rest.
    failed_at : (x, y), m, optional
        Position at which the robot has failed. Without either position, the robot is removed.

    Returns
    -------
    Continuation
    """
    setup = pane.setup
    positions = dict(zip(pane.numbers, pane.positions, strict=True))
    velocities = dict(zip(pane.numbers, pane.velocities, strict=True))
    positions.pop(number, None)
    velocities.pop(number, None)
    if working_at is not None:
        positions[number] = np.array(working_at)
        velocities[number] = np.zeros(2)
    failed = dict(setup.failed)
    failed.pop(number, None)
    if failed_at is not None:
        failed[number] = failed_at
    numbers = tuple(sorted(positions))
    if numbers != setup.numbers or failed != setup.failed:
        setup = setup.with_robots(numbers, failed)
    # If the working robots are the same and none was placed, positions and velocities do not change.
    if numbers == pane.numbers and working_at is None:
        return Continuation(setup)
    return Continuation(
        setup,
        np.array([positions[robot] for robot in numbers]),
        np.array([velocities[robot] for robot in numbers]),
    )
