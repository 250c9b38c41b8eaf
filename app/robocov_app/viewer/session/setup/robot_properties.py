"""Properties of the robots of a session, independent of how many robots there are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import ConfigDict, Field, WrapSerializer

from robocov.defaults import (
    DEFAULT_COMMUNICATION_RANGE_M,
    DEFAULT_MASS_KG,
    DEFAULT_MAX_ACCELERATION_M_S2,
    DEFAULT_MAX_SPEED_M_S,
    DEFAULT_RADIUS_M,
    DEFAULT_SENSING_RANGE_M,
    DEFAULT_TRACK_WIDTH_M,
    DEFAULT_TURNING_RATE_RAD_S,
    DEFAULT_VISCOSITY_N_S_M,
)
from robocov.team import UNITS, Team
from robocov.typing import FloatArray
from robocov_app.viewer.session.files.fields import convert_field

MAX_PROPERTY = 1e9

_VALUE = convert_field(
    Annotated[
        float | None, Field(strict=True, ge=0, le=MAX_PROPERTY, description="In SI units; null for no limit")
    ],
    load=lambda value, _: np.inf if value is None else value,
    dump=lambda value, _: value if np.isfinite(value) else None,
)
PropertyValue: TypeAlias = Annotated[float, _VALUE]


@dataclass(frozen=True)
class RobotProperties:
    """Properties of robots, from which a team of any size is built.

    Attributes
    ----------
    radius, mass, max_speed, max_acceleration, viscosity, sensing_range, communication_range, track_width, \
turning_rate : float
        As in `Team`, in SI units; infinite for no limit.
    values_by_robot : mapping
        Values of single robots that differ, by property and robot number.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    radius: PropertyValue = DEFAULT_RADIUS_M
    mass: PropertyValue = DEFAULT_MASS_KG
    max_speed: PropertyValue = DEFAULT_MAX_SPEED_M_S
    max_acceleration: PropertyValue = DEFAULT_MAX_ACCELERATION_M_S2
    viscosity: PropertyValue = DEFAULT_VISCOSITY_N_S_M
    sensing_range: PropertyValue = DEFAULT_SENSING_RANGE_M
    communication_range: PropertyValue = DEFAULT_COMMUNICATION_RANGE_M
    track_width: PropertyValue = DEFAULT_TRACK_WIDTH_M
    turning_rate: PropertyValue = DEFAULT_TURNING_RATE_RAD_S
    values_by_robot: Annotated[
        Mapping[str, Mapping[int, PropertyValue]],
        Field(
            alias="different", description="Values of single robots that differ, by property and robot number"
        ),
    ] = field(default_factory=dict)

    @classmethod
    def from_team(cls, team: Team, numbers: Sequence[int] | None = None) -> Self:
        """Read the properties of a team.

        Parameters
        ----------
        team : Team
            The robots.
        numbers : sequence of int or None
            Numbers of the robots; by default 1, 2, ...

        Returns
        -------
        RobotProperties
            If a property is not the same for all robots, the common value is that of the first robot, and
            `values_by_robot` lists the values of all robots.
        """
        if numbers is None:
            numbers = range(1, len(team) + 1)
        values_by_name = {name: getattr(team, name).tolist() for name in UNITS}
        values_by_robot = {}
        for name, values in values_by_name.items():
            if len(set(values)) > 1:
                values_by_robot[name] = dict(zip(numbers, values, strict=True))
        first_values = {name: values[0] for name, values in values_by_name.items()}
        return cls(**first_values, values_by_robot=values_by_robot)

    def build_team(self, numbers: Sequence[int]) -> Team:
        """Build the team of the robots with the given numbers.

        Raises
        ------
        ParameterError
            If `Team` does not accept a value.
        """
        team = Team.homogeneous(len(numbers), **{name: getattr(self, name) for name in UNITS})
        changed = dict[str, FloatArray]()
        for name, values in self.values_by_robot.items():
            common_value = getattr(self, name)
            changed[name] = np.array([values.get(number, common_value) for number in numbers])
        if changed:
            return replace(team, **changed)
        return team

    def get_radius(self, number: int) -> float:
        """Return the radius of a robot, m."""
        return float(self.build_team((number,)).radius[0])


def _drop_defaults(properties: RobotProperties, serialize: Any) -> dict[str, Any]:
    """Serialize properties, but omit optional keys with default values."""
    optional: dict[str, object] = {
        "different": {},
        "communication_range": None,  # no limit
        "track_width": DEFAULT_TRACK_WIDTH_M,
        "turning_rate": DEFAULT_TURNING_RATE_RAD_S,
    }
    content = serialize(properties)
    return {key: value for key, value in content.items() if key not in optional or value != optional[key]}


FileProperties: TypeAlias = Annotated[RobotProperties, WrapSerializer(_drop_defaults)]
"""Robot properties in a session file."""
