"""The model of ``run.json``, against which the file is checked when it is read.

The second name of a field is its former name, under which files of earlier versions contain it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AliasChoices, Field, create_model

from robocov.conditions import PARAMETERS, DensityKnowledge
from robocov.errors import format_bound
from robocov.files.documents import Document, expect
from robocov.team import MAX_ROBOTS

Seconds: TypeAlias = Annotated[float, Field(gt=0, le=1e6), expect("a number above 0 (s)")]
"""A duration above 0, s."""
Time: TypeAlias = Annotated[float, Field(ge=0, le=1e9), expect("a number of at least 0 (s)")]
"""A simulation time, s."""
RobotNumber: TypeAlias = Annotated[int, Field(ge=1, le=MAX_ROBOTS), expect("the number of a robot, from 1")]
"""The number of a robot, from 1."""
RobotKey: TypeAlias = Annotated[str, Field(pattern=r"^[1-9]\d{0,8}$"), expect("the number of a robot")]
"""The number of a robot as the key of an object."""
Point: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=2), expect("a point [x, y]")]
"""x and y, m."""
Seed: TypeAlias = Annotated[int, Field(ge=0), expect("a whole number of at least 0")]
"""The seed of a random start."""


class _Failure(Document):
    robot: RobotNumber
    time_s: Time


class _Join(_Failure):
    position_m: Point | None = Field(validation_alias=AliasChoices("position_m", "place_m"))


_LATER_CONDITIONS = ("bandwidth",)
"""Conditions that files of earlier versions do not contain; null by default."""


def _build_number_field(minimum: float, maximum: float, *, allow_null: bool, is_required: bool) -> Any:
    """Return the type and the default of a field for a number in a range, or null."""
    null = " or null" if allow_null else ""
    description = expect(f"a number from {format_bound(minimum)} to {format_bound(maximum)}{null}")
    number: Any = Annotated[float, Field(ge=minimum, le=maximum)]
    default: Any = ... if is_required else None
    return Annotated[number | None if allow_null else number, description], default


def _build_conditions_model() -> Any:
    """Build the pydantic model of `Conditions`. `PARAMETERS` gives the ranges of its numbers."""
    fields: dict[str, Any] = {
        "failures": (list[_Failure], ...),
        "joins": (list[_Join], ...),
        "seed": (Seed, ...),
        "density": (Annotated[DensityKnowledge, expect('"known" or "sensed"')], "known"),
    }
    for name, parameter in PARAMETERS.items():
        fields[parameter.json_key] = _build_number_field(
            parameter.minimum,
            parameter.maximum,
            allow_null=parameter.may_be_null,
            is_required=name not in _LATER_CONDITIONS,
        )
    return create_model("ConditionsDocument", __base__=Document, **fields)


ConditionsDocument: Any = _build_conditions_model()
"""The conditions of a run, with all keys that `Conditions.to_dict` writes."""


class _Controller(Document):
    name: Annotated[str, Field(min_length=1), expect("a name")]
    gains: dict[str, Annotated[float | str | bool | None, expect("a number, a word or null")]]


class _EditPeriod(Document):
    """A period during which the user moved robots."""

    from_s: Time
    to_s: Time
    robots: list[RobotNumber]


class _Placement(Document):
    """Robots that the user placed at other positions at a certain time."""

    time_s: Time
    robots: list[RobotNumber]


class JoinEvent(Document):
    """A robot that joined, with its actual and its requested position."""

    kind: Literal["join"]
    robot: RobotNumber
    time_s: Time
    position_m: Point = Field(validation_alias=AliasChoices("position_m", "place_m"))
    requested_position_m: Point = Field(validation_alias=AliasChoices("requested_position_m", "requested_m"))


class _Session(Document):
    """Origin of a run that is part of a session of the application."""

    began_at_s: Time = 0.0
    start_velocities_m_per_s: list[Point] = Field([])
    robots: list[RobotNumber] = Field([])
    failed: dict[RobotKey, Point] = Field({})
    edits: list[_EditPeriod] = Field([], validation_alias=AliasChoices("edits", "touched"))
    placements: list[_Placement] = Field([], validation_alias=AliasChoices("placements", "placed"))
    control_dt_s: Seconds = 1.0
    repeatable: bool = True


class RunDocument(Document):
    """The content of ``run.json``: everything that is needed to repeat a run, and its summary."""

    map: dict[str, Any]
    controller: _Controller
    team: dict[str, Any]
    start: Annotated[str | None, expect("the name of a start, or null")]
    starts_m: list[Point] = Field([])
    seed: Annotated[Seed | None, expect("a whole number of at least 0, or null")]
    dt_s: Seconds
    duration_s: Time = 0.0
    lattice: Annotated[int | None, Field(ge=2, le=2048), expect("a whole number from 2 to 2048")] = None
    conditions: ConditionsDocument | None = None
    events: list[JoinEvent] = Field([])
    session: _Session = _Session()
    versions: dict[str, str] = Field({})
    summary: dict[str, Any] = Field({})
