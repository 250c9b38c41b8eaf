"""Models of session files, from which their JSON schema is generated.

Files of early versions have other names for some keys, which are read, but never written: `touches` for
`edits`, `touch` for `edit`, and `words` for `description`.
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, AliasChoices, BaseModel, ConfigDict, Field

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
    at: Step
    kind: Text
    description: Text = Field(validation_alias=AliasChoices("description", "words"))
    name: Text = ""
    end: Step
    changes: Annotated[list[_FileEdit], Field(min_length=1)]
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

    bundled: Text
    digest: Text


class ConditionModel(_Model):
    """A condition, given by one of its fields."""

    step: Step | None = Field(None, description="A step of the simulation")
    settled: Literal[True] | None = Field(None, description="The team has settled")
    robot: RobotNumber | None = Field(
        None, description="The robot that is to be in `inside`, or out of `outside`"
    )
    inside: _Box | None = None
    outside: _Box | None = None
    mean_distance_below: Annotated[float, Field(gt=0)] | None = None


class QuestionModel(_Model):
    """A question for a prediction, before a chapter continues."""

    text: Text
    answers: Annotated[list[Text], Field(min_length=2, max_length=MAX_ANSWERS)]
    right: Annotated[int, Field(ge=1, le=MAX_ANSWERS, description="Number of the right answer")]
    why: Text = ""


class TaskModel(_Model):
    """Something that the viewer of a lesson does."""

    text: Text
    until: ConditionModel
    done: Text = "Done."


class ChapterModel(_Model):
    """A chapter of a lesson: the edits on the path to a node are repeated as time passes."""

    title: Annotated[str, Field(min_length=1, max_length=MAX_CHAPTER_TITLE_CHARS)]
    text: Text
    edit: int = Field(
        ge=0,
        description="Index of the last edit that the chapter repeats",
        validation_alias=AliasChoices("edit", "touch"),
    )
    until: ConditionModel
    speed: Annotated[float, Field(ge=MIN_CHAPTER_SPEED, le=MAX_CHAPTER_SPEED)] = 1.0
    show: list[str] = Field([], description="Layers in addition to the usual ones")
    robot: RobotNumber | None = Field(None, description="The robot that is inspected")
    question: QuestionModel | None = None
    task: TaskModel | None = None


class LessonModel(_Model):
    """The chapters of a lesson."""

    title: Annotated[str, Field(min_length=1, max_length=MAX_LESSON_TITLE_CHARS)]
    chapters: Annotated[list[ChapterModel], Field(min_length=1, max_length=MAX_CHAPTERS)]
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

    schema_: Annotated[str | None, Field(alias="$schema")] = None
    format: Literal["robocov-session"]
    version: Literal[1]
    robocov: Text = ""
    maps: Annotated[list[BundledMapModel | dict[str, Any]], Field(min_length=1), AfterValidator(_note_maps)]
    edits: list[NodeModel] = Field(min_length=1, validation_alias=AliasChoices("edits", "touches"))
    head: Annotated[int, Field(ge=0, description="Number of the edit whose time span contains the present")]
    step: Step
    view: dict[str, Any] = Field({}, description="Displayed layers and theme")
    lesson: LessonModel | None = None


def build_session_schema() -> dict[str, Any]:
    """Return the JSON schema of session files."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SessionModel.model_json_schema()}
