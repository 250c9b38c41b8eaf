"""The content of ``run.json``, version 1, as pydantic models."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeAlias

from pydantic import Field, create_model

from robocov.conditions import LIMITS
from robocov.files.documents import Document, read_document, wanted
from robocov.robots import MOST_ROBOTS

Seconds: TypeAlias = Annotated[float, Field(gt=0, le=1e6), wanted("a number above 0 (s)")]
Time: TypeAlias = Annotated[float, Field(ge=0, le=1e9), wanted("a number from 0 (s)")]
Number: TypeAlias = Annotated[int, Field(ge=1, le=MOST_ROBOTS), wanted("the number of a robot, from 1,")]
Key: TypeAlias = Annotated[str, Field(pattern=r"^[1-9]\d{0,8}$"), wanted("the number of a robot")]
Point: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=2), wanted("a point [x, y]")]
Seed: TypeAlias = Annotated[int, Field(ge=0), wanted("a whole number from 0")]


class _Failure(Document):
    robot: Number
    time_s: Time


class _Join(_Failure):
    place_m: Point | None


def _number(low: float, high: float, *, null: bool) -> Any:
    """Return what a field of a model is for a number in a range, or null."""
    words = wanted(f"a number from {low:g} to {high:g}{' or null' if null else ''}")
    number: Any = Annotated[float, Field(ge=low, le=high)]
    return Annotated[number | None if null else number, words], ...


_of_conditions: dict[str, Any] = {
    key: _number(low, high, null=name == "message_rate") for name, (low, high, _, key) in LIMITS.items()
} | {"failures": (list[_Failure], ...), "joins": (list[_Join], ...), "seed": (Seed, ...)}
_Conditions: Any = create_model("_Conditions", __base__=Document, **_of_conditions)


class _Controller(Document):
    name: Annotated[str, Field(min_length=1), wanted("a name")]
    gains: dict[str, Annotated[float | str | bool | None, wanted("a number, a word or null")]]


class _Touch(Document):
    """From when to when which robots were moved by hand."""

    from_s: Time
    to_s: Time
    robots: list[Number]


class _Session(Document):
    """See `robocov_app.demo.kept`."""

    began_at_s: Time = 0.0
    start_velocities_m_per_s: list[Point] = Field([])
    robots: list[Number] = Field([])
    failed: dict[Key, Point] = Field({})
    touched: list[_Touch] = Field([])
    control_dt_s: Seconds = 1.0
    repeatable: bool = True


class RunDocument(Document):
    """A run: all that is needed to repeat it, and its summary."""

    map: dict[str, Any]
    controller: _Controller
    team: dict[str, Any]
    start: Annotated[str | None, wanted("the name of a start, or null,")]
    starts_m: list[Point] = Field([])
    seed: Annotated[Seed | None, wanted("a whole number from 0, or null,")]
    dt_s: Seconds
    duration_s: Time = 0.0
    lattice: Annotated[int | None, Field(ge=2, le=2048), wanted("a whole number from 2 to 2048")] = None
    conditions: _Conditions | None = None
    session: _Session = _Session()
    versions: dict[str, str] = Field({})
    summary: dict[str, Any] = Field({})


def read_run(path: Path) -> RunDocument:
    """Return the content of a file ``run.json``; raise `MapError` with the place of what is wrong in it."""
    return read_document(path, RunDocument, "robocov-run", 1)
