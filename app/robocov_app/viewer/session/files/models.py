"""Models of session files, from which their JSON schema is generated.

Files of early versions have other names for some keys, which are read, but never written: `touches` for
`edits`, `touch` for `edit`, and `words` for `description`.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, AliasChoices, BaseModel, ConfigDict, Field

from robocov_app.docstrings import parse_attributes
from robocov_app.viewer.session.editing.edits import (
    DragRobot,
    MapEdit,
    PaneEdit,
    ReleaseRobot,
    RemovePane,
    Restart,
    RobotEdit,
    SessionEdit,
)
from robocov_app.viewer.session.files.fields import Coordinate, RobotNumber, Step, Text

MIN_CHAPTER_SPEED = 0.1
MAX_CHAPTER_SPEED = 16
MAX_ANSWERS = 4
MAX_CHAPTERS = 100
MAX_CLOSING_LINES = 6
MAX_CHAPTER_TITLE_CHARS = 60
MAX_LESSON_TITLE_CHARS = 100


@dataclass(frozen=True)
class DragPath(RobotEdit):
    """Consecutive points to which a robot is dragged.

    Attributes
    ----------
    path : list of list of float
        [step, x, y] of each point.
    """

    path: Annotated[list[Annotated[list[Coordinate], Field(min_length=3, max_length=3)]], Field(min_length=1)]
    do: Literal["drag"] = field(default="drag", kw_only=True)

    def to_edits(self) -> list[SessionEdit]:
        """Return one edit for each point."""
        return [DragRobot(self.robot, (x, y), step=int(step)) for step, x, y in self.path]


_FileEdit: TypeAlias = Annotated[
    DragPath | ReleaseRobot | RemovePane | Restart | PaneEdit | MapEdit, Field(discriminator="do")
]
_Box: TypeAlias = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class NodeModel(_Model):
    """One edit, and the time span until the next one."""

    parent: Annotated[int | None, Field(ge=0, description="Number of the edit before; null for the first")]
    at: Step = Field(description="Step before which the edit is made")
    kind: Text = Field(description="Kind of edit, which determines its icon")
    description: Text = Field(
        description="Description of the edit in the window",
        validation_alias=AliasChoices("description", "words"),
    )
    name: Text = Field("", description="Name of the branch that ends here")
    end: Step = Field(description="Last step of the time span")
    changes: Annotated[list[_FileEdit], Field(min_length=1, description="What the edit changes, in order")]
    curves: dict[str, list[list[Coordinate]]] = Field(
        {},
        description='Samples of the curves in this span: [times, values] of "pane distance" and "pane time"',
    )

    def to_edits(self) -> list[SessionEdit]:
        """Return the edits, with one for each point of a drag."""
        edits: list[SessionEdit] = []
        for edit in self.changes:
            if isinstance(edit, DragPath):
                edits += edit.to_edits()
            else:
                edits.append(edit)
        return edits


class BundledMapModel(_Model):
    """A map that comes with robocov."""

    bundled: Text = Field(description="Name of the map")
    digest: Text = Field(description="Digest of its content, by which a changed map is recognized")


class ConditionModel(_Model):
    """A condition, given by one of its fields."""

    step: Step | None = Field(None, description="A step of the simulation")
    settled: Literal[True] | None = Field(None, description="The team has settled")
    robot: RobotNumber | None = Field(
        None, description="Robot that must be inside the box `inside`, or outside the box `outside`"
    )
    inside: _Box | None = Field(None, description="Box [x_min, y_min, x_max, y_max] in meters")
    outside: _Box | None = Field(None, description="Box [x_min, y_min, x_max, y_max] in meters")
    mean_distance_below: Annotated[float, Field(gt=0)] | None = Field(
        None, description="The mean distance is below this value, in meters"
    )


class QuestionModel(_Model):
    """A question for a prediction, before a chapter continues."""

    text: Text = Field(description="The question")
    answers: Annotated[list[Text], Field(min_length=2, max_length=MAX_ANSWERS)] = Field(
        description="Answers to choose from"
    )
    right: Annotated[int, Field(ge=1, le=MAX_ANSWERS, description="Number of the right answer, from 1")]
    why: Text = Field("", description="Explanation, displayed after the answer")


class TaskModel(_Model):
    """An action that the viewer of a lesson is asked to do."""

    text: Text = Field(description="What the viewer does")
    until: ConditionModel = Field(description="Condition at which the task is done")
    done: Text = Field("Done.", description="Text displayed when the task is done")


class ChapterModel(_Model):
    """A chapter of a lesson: the edits on the path to a node are repeated as time passes."""

    title: Annotated[
        str, Field(min_length=1, max_length=MAX_CHAPTER_TITLE_CHARS, description="Title of the chapter")
    ]
    text: Text = Field(description="Text of the chapter")
    edit: int = Field(
        ge=0,
        description="Index of the last edit that the chapter repeats",
        validation_alias=AliasChoices("edit", "touch"),
    )
    until: ConditionModel = Field(description="Condition at which the chapter ends")
    speed: Annotated[float, Field(ge=MIN_CHAPTER_SPEED, le=MAX_CHAPTER_SPEED)] = Field(
        1.0, description="Playback speed"
    )
    show: list[str] = Field([], description="Layers in addition to the usual ones")
    robot: RobotNumber | None = Field(None, description="The robot that is inspected")
    question: QuestionModel | None = Field(None, description="Question before the chapter plays")
    task: TaskModel | None = Field(None, description="Task after the chapter has played")


class LessonModel(_Model):
    """The chapters of a lesson."""

    title: Annotated[
        str, Field(min_length=1, max_length=MAX_LESSON_TITLE_CHARS, description="Title of the lesson")
    ]
    chapters: Annotated[list[ChapterModel], Field(min_length=1, max_length=MAX_CHAPTERS)] = Field(
        description="Chapters in order"
    )
    found: Annotated[list[Text], Field(max_length=MAX_CLOSING_LINES)] = Field(
        default=[], description="Findings of the lesson, listed on its closing page"
    )
    next_steps: Annotated[list[Text], Field(max_length=MAX_CLOSING_LINES)] = Field(
        default=[], description="What to try after the lesson, on its closing page"
    )


def _note_maps(maps: list[BundledMapModel | dict[str, Any]], info: Any) -> list[Any]:
    """Store the maps in the context, where fields that refer to them and are validated later find them."""
    info.context.maps = maps
    return maps


class SessionModel(_Model, title="robocov session"):
    """A session of the window: a tree of edits from which every state can be recomputed."""

    schema_: str | None = Field(None, alias="$schema", description="Address of the schema, for text editors")
    format: Literal["robocov-session"] = Field(description="Format of the file")
    version: Literal[1] = Field(description="Version of the format")
    robocov: Text = Field("", description="Version of robocov that has saved the session")
    maps: Annotated[
        list[BundledMapModel | dict[str, Any]],
        Field(min_length=1, description="Bundled maps by name, others with their content"),
        AfterValidator(_note_maps),
    ]
    edits: list[NodeModel] = Field(
        min_length=1,
        description="All edits; the first one starts the session",
        validation_alias=AliasChoices("edits", "touches"),
    )
    head: Annotated[int, Field(ge=0, description="Number of the edit whose time span contains the present")]
    step: Step = Field(description="Displayed step")
    view: dict[str, Any] = Field({}, description="Displayed layers and theme")
    lesson: LessonModel | None = Field(None, description="Lesson, if the session contains one")


def build_session_schema() -> dict[str, Any]:
    """Return the JSON schema of session files."""
    schema = SessionModel.model_json_schema()
    # The fields of the session itself, at the root, are described in place.
    for definition in schema["$defs"].values():
        _describe_fields(definition)
        _correct_defaults(definition)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _describe_fields(definition: dict[str, Any]) -> None:
    """Move the descriptions in the section Attributes of a docstring to the fields of its schema."""
    docstring = definition.get("description", "")
    summary, _, _ = docstring.partition("\n\n")
    definition["description"] = summary
    fields = definition.get("properties", {})
    for name, meaning in parse_attributes(docstring).items():
        if name in fields:
            fields[name].setdefault("description", _format_meaning(meaning))
    if "do" in fields:
        fields["do"].setdefault("description", "Kind of the change, which determines the other keys")


def _format_meaning(text: str) -> str:
    """Format the description of an attribute for JSON, in which None is called null."""
    return text.removesuffix(".").replace("None", "null")


def _correct_defaults(definition: dict[str, Any]) -> None:
    """Replace infinite defaults with null, as in files; remove objects, whose types list their defaults."""
    for field_schema in definition.get("properties", {}).values():
        default = field_schema.get("default")
        if default == math.inf:
            field_schema["default"] = None
        elif isinstance(default, dict) and default:
            del field_schema["default"]
