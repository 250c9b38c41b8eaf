"""The scenario of a session: one map and team under up to four controllers."""

from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import ConfigDict, Field, WrapSerializer

from robocov.conditions import Conditions
from robocov.defaults import DEFAULT_CONTROLLER, DEFAULT_DT_S, DEFAULT_ROBOTS
from robocov.environment import Environment
from robocov.errors import ParameterError, quote
from robocov.scenario import Scenario
from robocov.typing import FloatArray
from robocov_app.viewer.session.files.fields import Position, Text, convert_field, keep_none
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice, FileController
from robocov_app.viewer.session.setup.robot_properties import FileProperties, RobotProperties

MAX_ROBOTS = 1000
"""Maximum number of robots in the window."""
MAX_COMMUNICATING_ROBOTS = 100
"""Maximum number of robots if every robot stores the messages of all others."""
MAX_PANES = 4
"""Maximum number of controllers that are compared side by side."""
DEFAULT_PROPERTIES = RobotProperties()
MIN_DT_S = 1e-4
MAX_DT_S = 1.0

_MAP = convert_field(
    Annotated[int, Field(strict=True, ge=0, description="Number of the map in `maps`")],
    load=lambda number, context: context.get_environment(number),
    dump=lambda environment, context: context.get_number(environment),
)
_ROWS = convert_field(
    list[Position] | None,
    load=keep_none(lambda rows, _: np.array(rows)),
    dump=keep_none(lambda rows, _: np.asarray(rows).tolist()),
)
_CONDITIONS = convert_field(
    dict[str, Any] | None,
    load=keep_none(lambda content, _: Conditions.from_dict(content)),
    dump=keep_none(lambda conditions, _: conditions.to_dict()),
)


def require_space_for_pane(count: int) -> None:
    """Raise a ParameterError if no pane can be added to `count` others."""
    if count >= MAX_PANES:
        raise ParameterError(f"expected at most {MAX_PANES} controllers side by side")


@dataclass(frozen=True, eq=False)
class SessionScenario:
    """Initial conditions of the panes of a session: one `robocov.Scenario` for each controller.

    Attributes
    ----------
    environment : Environment
        The map.
    controllers : tuple of ControllerChoice
        One for each pane.
    robots : int
        Number of robots.
    start : str or None
        Name of a start of the map; None for its first one.
    seed : int
        Seed of the starting positions.
    properties : RobotProperties
        Properties of the robots.
    dt : float, s
        Control period.
    given_starts : (n, 2) array or None, m
        Starting positions; None to sample them.
    velocities : (n, 2) array or None, m/s
        Initial velocities of robots with given starts.
    steering : (n, 2) array or None, rad and rad/s
        Initial headings and turning rates of unicycles with given starts.
    conditions : Conditions or None
        Noise, message loss, and robots that fail or join at given times.

    Raises
    ------
    ParameterError
        If there are too many robots or controllers, or none.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    environment: Annotated[Environment, _MAP, Field(alias="map")]
    controllers: tuple[FileController, ...] = (ControllerChoice(DEFAULT_CONTROLLER),)
    robots: Annotated[int, Field(strict=True, ge=1, le=MAX_ROBOTS)] = DEFAULT_ROBOTS
    start: Text | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    properties: Annotated[FileProperties, Field(alias="team", description="Properties of the robots")] = (
        DEFAULT_PROPERTIES
    )
    dt: Annotated[
        float,
        Field(strict=True, alias="dt_s", ge=MIN_DT_S, le=MAX_DT_S, description="Control period in seconds"),
    ] = DEFAULT_DT_S
    given_starts: Annotated[
        FloatArray | None,
        _ROWS,
        Field(alias="starts_m", description="[x, y] of each robot in meters; null to sample them"),
    ] = None
    velocities: Annotated[
        FloatArray | None,
        _ROWS,
        Field(alias="start_velocities_m_per_s", description="Initial velocities [vx, vy] in m/s"),
    ] = None
    steering: Annotated[
        FloatArray | None,
        _ROWS,
        Field(alias="start_steering", description="[heading, turning rate] of unicycles in rad and rad/s"),
    ] = None
    conditions: Annotated[Conditions | None, _CONDITIONS] = None

    def __post_init__(self) -> None:
        """Check the numbers of robots and controllers."""
        if not 1 <= self.robots <= MAX_ROBOTS:
            expected = f"expected a whole number from 1 to {MAX_ROBOTS}"
            raise ParameterError(f"robots: {expected}, got {quote(self.robots)}")
        uses_messages = self.conditions is not None and self.conditions.uses_messages
        if uses_messages and self.robots > MAX_COMMUNICATING_ROBOTS:
            expected = f"expected at most {MAX_COMMUNICATING_ROBOTS} with lost or delayed messages"
            reason = "The window stores the messages of every step."
            raise ParameterError(f"robots: {expected}, got {self.robots}. {reason}")
        if not 1 <= len(self.controllers) <= MAX_PANES:
            raise ParameterError(f"controllers: expected 1 to {MAX_PANES}, got {len(self.controllers)}")

    @property
    def start_name(self) -> str:
        """Name of the start, even if an edit has removed it from the map."""
        if self.start is not None and self.start not in self.environment.starts:
            return self.start
        return self.environment.start(self.start).name

    @property
    def starts(self) -> FloatArray:
        """Starting positions of all robots, (n, 2) m.

        Raises
        ------
        StartError
            If the start is unknown, or has no space for the team.
        """
        return self.build_scenario().starts

    def build_scenario(self, pane: int = 0) -> Scenario:
        """Build the scenario for one of the controllers.

        Parameters
        ----------
        pane : int
            Index of the controller.

        Returns
        -------
        Scenario

        Raises
        ------
        ParameterError
            If a value cannot be used.
        """
        return Scenario(
            self.environment,
            self.controllers[pane].build(),
            team=self.properties.build_team(range(1, self.robots + 1)),
            start=self.start,
            seed=self.seed,
            starts=self.given_starts,
            velocities=self.velocities if self.given_starts is not None else None,
            steering=self.steering if self.given_starts is not None else None,
            dt=self.dt,
            conditions=self.conditions,
        )


def _omit_missing_steering(scenario: SessionScenario, serialize: Any) -> dict[str, Any]:
    """Serialize a scenario without the key of the steering if there is none, as in earlier versions."""
    content: dict[str, Any] = serialize(scenario)
    if scenario.steering is None:
        del content["start_steering"]
    return content


FileScenario: TypeAlias = Annotated[SessionScenario, WrapSerializer(_omit_missing_steering)]
"""A scenario as it is stored in a session file."""
