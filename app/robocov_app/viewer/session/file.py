"""Session files, ``NAME.robocov``: the document as versioned JSON of a few kilobytes.

Bundled maps are named, with a digest; others are in the file whole, once. A controller of the user's own is
named by its path, and never run because a file says so.
"""

import hashlib
import json
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from robocov.environment import Environment
from robocov.errors import MapError, Mistake, quote_json
from robocov.files.documents import build_document_error, check_header
from robocov.files.strictjson import locate_mistakes, parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, list_bundled_maps, load_map, to_json
from robocov_app.viewer.session import changes
from robocov_app.viewer.session.changes import Change, Drag, Restart, Robot, Step
from robocov_app.viewer.session.scenario import Coordinate, Text
from robocov_app.viewer.session.undo_tree import Document, Node

FORMAT, VERSION, SUFFIX = "robocov-session", 1, ".robocov"
MOST_SAMPLES = 30  # samples of a curve that stand in the file, for each touch
# what pydantic says of a kind that there is not
_TAG = re.compile(r"Input tag '(?P<found>.*?)' found using '(?P<key>\w+)' .* expected tags: (?P<known>.*)")


@dataclass(frozen=True)
class _Pulled(changes.OfRobot):
    """The hand holds a robot and pulls it: [step, x, y] wherever it moved."""

    path: Annotated[list[Annotated[list[Coordinate], Field(min_length=3, max_length=3)]], Field(min_length=1)]
    do: Literal["drag"] = field(default="drag", kw_only=True)


_OTHER: TypeAlias = changes.Release | changes.RemovePane | Restart | changes.PaneChange | changes.MapChange
_CHANGE = Annotated[_Pulled | _OTHER, Field(discriminator="do")]
_WRITER: TypeAdapter[Change] = TypeAdapter(Change)
_Box = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class TouchModel(_Model):
    """One touch, and the time that passed after it."""

    parent: Annotated[int | None, Field(ge=0, description="Number of the touch before; null for the first")]
    at: Step
    kind: Text
    words: Text
    name: Text = ""
    end: Step
    changes: Annotated[list[_CHANGE], Field(min_length=1)]
    curves: dict[str, list[list[Coordinate]]] = Field(
        {}, description='What was plotted meanwhile: [times, values] of "pane distance" and "pane time"'
    )


class BundledMapModel(_Model):
    """A map that comes with robocov."""

    bundled: Text
    digest: Text


class ConditionModel(_Model):
    """Condition that is waited for: one of these."""

    step: Step | None = Field(None, description="A step of the simulation")
    settled: Literal[True] | None = Field(None, description="No robot gets anywhere any more")
    robot: Robot | None = Field(None, description="The robot that is to be in `inside`, or out of `outside`")
    inside: _Box | None = None
    outside: _Box | None = None
    mean_distance_below: Annotated[float, Field(gt=0)] | None = None


class QuestionModel(_Model):
    """A prediction that is asked for before a chapter goes on."""

    text: Text
    answers: Annotated[list[Text], Field(min_length=2, max_length=4)]
    right: Annotated[int, Field(ge=1, le=4, description="Number of the right answer")]
    why: Text = ""


class TaskModel(_Model):
    """Something that is handed over to whoever watches."""

    text: Text
    until: ConditionModel
    done: Text = "Done."


class ChapterModel(_Model):
    """A scene: what was done on the way to a touch is done again as time goes by."""

    title: Annotated[str, Field(min_length=1, max_length=60)]
    text: Text
    touch: Annotated[int, Field(ge=0, description="The touch at which its branch ends")]
    until: ConditionModel
    speed: Annotated[float, Field(ge=0.1, le=16)] = 1.0
    show: list[str] = Field([], description="Layers beside the usual ones")
    robot: Robot | None = Field(None, description="The robot that is asked about")
    question: QuestionModel | None = None
    task: TaskModel | None = None


class LessonModel(_Model):
    """Chapters of a lesson."""

    title: Annotated[str, Field(min_length=1, max_length=100)]
    chapters: Annotated[list[ChapterModel], Field(min_length=1, max_length=100)]


def _noted(maps: list[BundledMapModel | dict[str, Any]], info: Any) -> list[Any]:
    info.context.maps = maps
    return maps


class SessionModel(_Model, title="robocov session"):
    """A session of the window: a tree of touches from which every moment can be made again."""

    schema_: Annotated[str | None, Field(alias="$schema")] = None
    format: Literal["robocov-session"]
    version: Literal[1]
    robocov: Text = ""
    maps: Annotated[list[BundledMapModel | dict[str, Any]], Field(min_length=1), AfterValidator(_noted)]
    touches: Annotated[list[TouchModel], Field(min_length=1)]
    head: Annotated[int, Field(ge=0, description="Touch in whose time the present is")]
    step: Step
    view: dict[str, Any] = Field({}, description="What is shown, and how")
    lesson: LessonModel | None = None


@dataclass(frozen=True, eq=False)
class SavedSession:
    """Content of a session file."""

    document: Document
    head: Node
    step: int  # the present
    view: Mapping[str, Any] = field(default_factory=dict)
    lesson: LessonModel | None = None


def session_schema() -> dict[str, Any]:
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SessionModel.model_json_schema()}


def save_session(path: Path, document: Document, head: Node, step: int, view: Mapping[str, Any]) -> None:
    """Write a session file, whole or not at all; OutputError when it cannot be written."""
    content = session_json(document, head, step, view)
    with replace_file(path) as part:
        part.write_text(dumped(content), encoding="utf-8")


def dumped(content: Mapping[str, Any]) -> str:
    write = partial(json.dumps, ensure_ascii=False, allow_nan=False)
    touches = ",\n  ".join(map(write, content["touches"]))
    text = write({key: value for key, value in content.items() if key != "touches"}, indent=1)
    return text.removesuffix("\n}") + f',\n "touches": [\n  {touches}\n ]\n}}\n'


def session_json(document: Document, head: Node, step: int, view: Mapping[str, Any]) -> dict[str, Any]:
    from robocov import __version__

    maps = _Maps()
    touches = [_touch_json(node, maps) for node in document.nodes]
    content = {"format": FORMAT, "version": VERSION, "robocov": __version__, "maps": maps.maps}
    return {**content, "touches": touches, "head": head.number, "step": step, "view": dict(view)}


def _touch_json(node: Node, maps: "_Maps") -> dict[str, Any]:
    told: list[dict[str, Any]] = []
    for change in node.changes:
        if not isinstance(change, Drag):
            told.append(_WRITER.dump_python(change, mode="json", by_alias=True, context=maps))
            continue
        if not (told and told[-1]["do"] == "drag" and told[-1]["robot"] == change.robot):
            told.append({"step": change.step, "do": "drag", "robot": change.robot, "path": []})
        told[-1]["path"].append([change.step, *change.to])
    parent, named = node.parent and node.parent.number, {"name": node.name} if node.name else {}
    head = {"parent": parent, "at": node.at, "kind": node.kind, "words": node.words, **named}
    drawn = {key: curve for key, curve in node.curves.items() if len(curve)}
    curves = {f"{pane} {what}": each.outline(MOST_SAMPLES) for (pane, what), each in drawn.items()}
    return {**head, "end": node.end, "changes": told, **({"curves": curves} if curves else {})}


def load_session(path: Path, controllers: Collection[str] = ()) -> SavedSession:
    """Return the content of a session file.

    `controllers`: the user's own that may be run. MapError, one line: file, line and column, JSON path, value
    and the expected value.
    """
    text, where = read_bytes(path), str(path)
    content = parse_json(text, where)
    try:
        return session_of(content, where, controllers)
    except MapError as error:
        raise locate_mistakes(error, text, where) from None


def session_of(content: Any, where: str, controllers: Collection[str] = ()) -> SavedSession:
    check_header(content, where, FORMAT, VERSION)
    try:
        model = SessionModel.model_validate(content, context=_Maps(where, controllers))
    except ValidationError as error:
        raise build_document_error(error, where, _mistake) from None
    refuse, nodes = partial(_refuse, where), list[Node]()
    for touch in model.touches:
        nodes.append(_node(touch, nodes, partial(refuse, "touches", len(nodes))))
    wanted = f"the number of a touch, 0 to {len(nodes) - 1}"
    if model.head >= len(nodes):
        refuse("head", value=model.head, wanted=wanted)
    head = nodes[model.head]
    if not head.begin <= model.step <= head.end:
        refuse("step", value=model.step, wanted=f"a step of the head, {head.begin} to {head.end}")
    for k, chapter in enumerate(model.lesson.chapters if model.lesson else ()):
        at, asked = partial(refuse, "lesson", "chapters", k), chapter.question
        if chapter.touch >= len(nodes):
            at("touch", value=chapter.touch, wanted=wanted)
        if asked is not None and asked.right > len(asked.answers):
            at("question", "right", value=asked.right, wanted="the number of an answer")
    return SavedSession(Document(nodes=nodes), head, model.step, model.view, model.lesson)


def _node(touch: TouchModel, nodes: list[Node], refuse: Callable[..., None]) -> Node:
    first = not nodes
    if (touch.parent is None) != first or (touch.parent is not None and touch.parent >= len(nodes)):
        refuse("parent", value=touch.parent, wanted="null for the first, else an earlier number")
    if first and not isinstance(touch.changes[0], Restart):
        refuse("changes", 0, "do", value=touch.changes[0].do, wanted='"restart"')
    made: list[Change] = []
    for each in touch.changes:
        if isinstance(each, _Pulled):
            made += [Drag(each.robot, (x, y), step=int(step)) for step, x, y in each.path]
        else:
            made.append(each)
    parent = None if touch.parent is None else nodes[touch.parent]
    node = Node(len(nodes), parent, touch.at, touch.kind, touch.words, made, touch.end, touch.name)
    if parent is not None and not parent.begin <= touch.at <= parent.end:
        refuse("at", value=touch.at, wanted=f"a step of touch {touch.parent}, {parent.begin} to {parent.end}")
    steps = [node.begin, *(change.step for change in made)]
    if steps != sorted(steps) or steps[1] != node.begin or node.end < steps[-1]:
        refuse("end", value=touch.end, wanted="a step from those of its changes on, in order")
    for name, samples in touch.curves.items():
        pane, _, what = name.partition(" ")
        if not pane.isdecimal() or what not in ("distance", "time") or len(samples) != 2:
            refuse("curves", value=name, wanted='"0 distance", "0 time", ... with times and values')
        for time, value in zip(*samples, strict=False):
            node.curves[int(pane), what].add(time, value)
    return node


def _refuse(where: str, *path: str | int, value: object, wanted: str) -> None:
    raise MapError.from_mistakes(
        where, [Mistake.at_path(path, f"expected {wanted}, got {quote_json(value)}")]
    )


class _Maps:
    """The maps of a file, by number; what it is called, and what controllers it may have run."""

    def __init__(self, where: str = "", controllers: Collection[str] = ()) -> None:
        self.where, self.controllers, self.maps = where, controllers, list[Any]()
        self.environment = cache(self._environment)

    def number(self, environment: Environment) -> int:
        document = _map_json(environment)
        if document not in self.maps:
            self.maps.append(document)
        return self.maps.index(document)

    def _environment(self, number: int) -> Environment:
        if number >= len(self.maps):
            words = f"the number of a map, 0 to {len(self.maps) - 1}"
            raise PydanticCustomError("wanted", "{words}", {"words": words})
        model = self.maps[number]
        if not isinstance(model, BundledMapModel):
            try:
                return from_json(model)
            except MapError as error:
                words = f"maps[{number}]: {str(error).removeprefix('map: ')}"
                raise MapError.from_mistakes(self.where, [Mistake(("maps", number), words)]) from None
        refuse = partial(_refuse, self.where, "maps", number)
        if model.bundled not in list_bundled_maps():
            refuse("bundled", value=model.bundled, wanted="the name of a bundled map")
        found = load_map(model.bundled)
        if _digest(to_json(found)) != model.digest:
            refuse("digest", value=model.digest, wanted="that of the map as it is now")
        return found


@lru_cache(maxsize=8)
def _map_json(environment: Environment) -> dict[str, Any]:
    document = to_json(environment)
    name = _bundled().get(digest := _digest(document))
    return document if name is None else {"bundled": name, "digest": digest}


@cache
def _bundled() -> dict[str, str]:
    return {_digest(to_json(load_map(name))): name for name in list_bundled_maps()}


def _digest(document: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


def _mistake(detail: Any) -> Mistake:
    steps = list(detail["loc"])
    # pydantic names the kind that it has chosen as a step of the path
    tags = [k for k in range(2, len(steps)) if steps[k - 2] in ("changes", "added", "maps", "gains")]
    path = tuple(step for k, step in enumerate(steps) if k not in tags)
    if detail["type"] in ("refused", "missing"):
        return Mistake.at_path(path, "missing" if detail["type"] == "missing" else str(detail["msg"]))
    if detail["type"] == "extra_forbidden":
        return Mistake.at_path(path, "unknown key", at_key=True)
    if detail["type"] in ("model_type", "dataclass_type"):
        return Mistake.at_path(path, f"expected an object, got {quote_json(detail['input'])}")
    if (tag := _TAG.match(str(detail["msg"]))) is not None:
        wanted = f"expected one of {tag['known']}"
        return Mistake.at_path((*path, tag["key"]), f"{wanted}, got {quote_json(tag['found'])}")
    words = str(detail["msg"]).removeprefix("Input should be ").replace("a valid integer", "an integer")
    words = words.replace("a valid ", "a ")
    words = re.sub(r".* should have (.*?)( after validation)?, not \d+", r"\1", words)
    return Mistake.at_path(path, f"expected {words}, got {quote_json(detail['input'])}")
