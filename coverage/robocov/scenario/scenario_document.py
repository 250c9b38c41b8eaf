"""The model of scenario files, against which they are checked when they are read."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from robocov.conditions import Conditions
from robocov.defaults import DEFAULT_CONTROLLER, DEFAULT_DT_S, DEFAULT_DURATION_S
from robocov.errors import ParameterError, describe_unknown_name
from robocov.files.documents import Document, expect
from robocov.record.run_document import ConditionsDocument, Point, Seconds, Seed, Time

FORMAT = "robocov-scenario"
"""Name of the format."""
FORMAT_VERSION = 1
"""Current version of the format."""


class ControllerEntry(Document):
    """A controller by name, with the gains that differ from their defaults."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: Annotated[str, Field(min_length=1), expect("a name")] = DEFAULT_CONTROLLER
    gains: dict[str, Annotated[float | str | bool | None, expect("a number, a word or null")]] = Field({})


def _fill_conditions(content: Any) -> Any:
    """Add the defaults of missing keys to conditions; raise ParameterError if a key is unknown."""
    if not isinstance(content, dict):
        return content
    for key in content:
        if key not in ConditionsDocument.model_fields:
            # This is no ValueError, so pydantic passes it on unchanged.
            raise ParameterError(
                f"conditions: {describe_unknown_name('key', key, ConditionsDocument.model_fields)}"
            )
    return {**Conditions().to_dict(), **content}


class ScenarioDocument(Document):
    """The content of a scenario file. Only `map` is required; other keys have the defaults of `Scenario`.

    The keys are those of ``run.json``. `map` may also be the name of a bundled map, or the path of a file
    relative to the folder of the scenario file.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    format: Literal["robocov-scenario"]
    version: Literal[1]
    map: Annotated[str | dict[str, Any], expect("a map, its name, or the path of its file")]
    controller: ControllerEntry = ControllerEntry()
    team: dict[str, Any] = Field({})
    start: Annotated[str | None, expect("the name of a start, or null")] = None
    seed: Annotated[Seed | None, expect("a whole number of at least 0, or null")] = 0
    starts_m: Annotated[list[Point] | None, expect("a list of points [x, y], or null")] = None
    start_velocities_m_per_s: Annotated[list[Point] | None, expect("a list of [x, y], or null")] = None
    start_steering: Annotated[list[Point] | None, expect("a list of [heading, turning rate], or null")] = None
    duration_s: Time = DEFAULT_DURATION_S
    dt_s: Seconds = DEFAULT_DT_S
    conditions: Annotated[ConditionsDocument | None, BeforeValidator(_fill_conditions)] = None
