"""Session files, ``NAME.robocov``: the document as versioned JSON of a few kilobytes.

Bundled maps are named, with a digest; others are in the file whole, once. A controller of the user's own is
named by its path, and never run because a file says so.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import Value
from robocov.environment import Environment
from robocov.errors import InputError, MapError, Mistake, RobocovError, shown_json
from robocov.files.atomic import written
from robocov.files.strictjson import check_header, located, parse, read_bytes, refused
from robocov.mapfile import bundled_maps, density_of, from_json, load_map, to_json
from robocov.mapfile.models import DensityModel, ObstacleModel, plain
from robocov.robots import UNITS
from robocov_app.viewer.session.changes import (
    Change,
    Drag,
    EditObstacles,
    Fail,
    Join,
    Leave,
    Paint,
    Place,
    Release,
    RemovePane,
    Restart,
    Revive,
    SetController,
    SetDensity,
    SetLimits,
)
from robocov_app.viewer.session.curves import Curve
from robocov_app.viewer.session.document import Document, Node
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec

FORMAT, VERSION, SUFFIX = "robocov-session", 1, ".robocov"

MOST_STEPS = 100_000_000

MOST_SAMPLES = 30
"""Samples of a curve that stand in the file, for each touch."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


_Step: TypeAlias = Annotated[int, Field(ge=0, le=MOST_STEPS, description="Control steps since time 0")]
_Robot: TypeAlias = Annotated[int, Field(ge=1, le=1_000_000, description="Number of a robot")]
_Pane: TypeAlias = Annotated[int, Field(ge=0, le=100, description="Number of a pane")]
_Coordinate: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
_Point: TypeAlias = Annotated[
    list[_Coordinate], Field(min_length=2, max_length=2, description="[x, y] in metres")
]
_Moved: TypeAlias = Annotated[list[_Coordinate], Field(min_length=3, max_length=3)]
_Text: TypeAlias = Annotated[str, Field(max_length=10_000)]
_Limit: TypeAlias = Annotated[float | None, Field(ge=0, le=1e9, description="null: no limit")]


class ControllerModel(_Model):
    """A controller, by name or as ``mine.py:MyController``, with gains that differ from their defaults."""

    name: Annotated[str, Field(min_length=1, max_length=10_000)]
    gains: dict[str, float | str | bool | None] = Field({})


class TeamModel(_Model):
    """What each robot is and can do; SI units."""

    radius: _Limit
    mass: _Limit
    max_speed: _Limit
    max_acceleration: _Limit
    viscosity: _Limit
    sensing_range: _Limit
    communication_range: _Limit
    different: dict[str, dict[str, _Limit]] = Field(
        {}, description="Values of single robots, by their numbers"
    )


class ScenarioModel(_Model):
    """What a run begins with."""

    map: Annotated[int, Field(ge=0, description="Number of the map in `maps`")]
    controllers: Annotated[list[ControllerModel], Field(min_length=1, max_length=4)]
    robots: Annotated[int, Field(ge=1, le=1000)]
    start: _Text | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    team: TeamModel
    dt_s: Annotated[float, Field(ge=1e-4, le=1)]
    starts_m: list[_Point] | None = None
    start_velocities_m_per_s: list[_Point] | None = None
    conditions: dict[str, Any] | None = None


class _At(_Model):
    step: _Step


class RestartModel(_At):
    """All begin anew, at time 0."""

    do: Literal["restart"]
    scenario: ScenarioModel


class DragModel(_At):
    """The hand holds a robot and pulls it: [step, x, y] wherever it moved."""

    do: Literal["drag"]
    robot: _Robot
    path: Annotated[
        list[Annotated[list[_Coordinate], Field(min_length=3, max_length=3)]], Field(min_length=1)
    ]


class ReleaseModel(_At):
    """The hand lets go."""

    do: Literal["release"]


class PlaceModel(_At):
    """A robot is put at a point, or joins there."""

    do: Literal["place", "join"]
    robot: _Robot
    at: _Point


class RobotModel(_At):
    """A robot is taken out, fails, or works again."""

    do: Literal["leave", "fail", "revive"]
    robot: _Robot


class ObstaclesModel(_At):
    """Obstacles number `first` to `first + removed - 1` are replaced by others."""

    do: Literal["obstacles"]
    first: Annotated[int, Field(ge=0)]
    removed: Annotated[int, Field(ge=0)]
    added: list[ObstacleModel]


class PaintModel(_At):
    """Dabs of a brush that raise the density, or lower it."""

    do: Literal["paint"]
    dabs: list[_Point]
    radius: Annotated[float, Field(gt=0, le=1e6)]
    lowers: bool


class DensityChangeModel(_At):
    """Places count by another density."""

    do: Literal["density"]
    density: DensityModel | None


class ControllerChangeModel(_At):
    """Another controller, or other gains, take over in a pane."""

    do: Literal["controller"]
    pane: _Pane
    controller: ControllerModel


class TeamChangeModel(_At):
    """All robots are, and can do, something else."""

    do: Literal["team"]
    team: TeamModel


class RemovePaneModel(_At):
    """A pane is left out."""

    do: Literal["remove-pane"]
    pane: _Pane


ChangeModel: TypeAlias = Annotated[
    RestartModel
    | DragModel
    | ReleaseModel
    | PlaceModel
    | RobotModel
    | ObstaclesModel
    | PaintModel
    | DensityChangeModel
    | ControllerChangeModel
    | TeamChangeModel
    | RemovePaneModel,
    Field(discriminator="do"),
]


class TouchModel(_Model):
    """One touch, and the time that passed after it."""

    parent: Annotated[int | None, Field(ge=0, description="Number of the touch before; null for the first")]
    at: _Step
    kind: _Text
    words: _Text
    name: _Text = ""
    end: _Step
    changes: Annotated[list[ChangeModel], Field(min_length=1)]
    curves: dict[str, list[list[_Coordinate]]] = Field(
        {}, description='What was plotted meanwhile: [times, values] of "pane distance" and "pane time"'
    )


class BundledMapModel(_Model):
    """A map that comes with robocov."""

    bundled: _Text
    digest: _Text


class ConditionModel(_Model):
    """What is waited for: one of these."""

    step: _Step | None = Field(None, description="A step of the simulation")
    settled: Literal[True] | None = Field(None, description="No robot gets anywhere any more")
    robot: _Robot | None = Field(None, description="The robot that is to be in `inside`, or out of `outside`")
    inside: Annotated[list[_Coordinate], Field(min_length=4, max_length=4)] | None = None
    outside: Annotated[list[_Coordinate], Field(min_length=4, max_length=4)] | None = None
    mean_distance_below: Annotated[float, Field(gt=0)] | None = None


class QuestionModel(_Model):
    """A prediction that is asked for before a chapter goes on."""

    text: _Text
    answers: Annotated[list[_Text], Field(min_length=2, max_length=4)]
    right: Annotated[int, Field(ge=1, le=4, description="Number of the right answer")]
    why: _Text = ""


class TaskModel(_Model):
    """Something that is handed over to whoever watches."""

    text: _Text
    until: ConditionModel
    done: _Text = "Done."


class ChapterModel(_Model):
    """A scene: what was done on the way to a touch is done again as time goes by."""

    title: Annotated[str, Field(min_length=1, max_length=60)]
    text: _Text
    touch: Annotated[int, Field(ge=0, description="The touch at which its branch ends")]
    until: ConditionModel
    speed: Annotated[float, Field(ge=0.1, le=16)] = 1.0
    show: list[str] = Field([], description="Layers beside the usual ones")
    robot: _Robot | None = Field(None, description="The robot that is asked about")
    question: QuestionModel | None = None
    task: TaskModel | None = None


class LessonModel(_Model):
    """Chapters of a lesson."""

    title: Annotated[str, Field(min_length=1, max_length=100)]
    chapters: Annotated[list[ChapterModel], Field(min_length=1, max_length=100)]


class SessionModel(_Model, title="robocov session"):
    """A session of the window: a tree of touches from which every moment can be made again."""

    schema_: Annotated[str | None, Field(alias="$schema")] = None
    format: Literal["robocov-session"]
    version: Literal[1]
    robocov: _Text = ""
    maps: Annotated[list[BundledMapModel | dict[str, Any]], Field(min_length=1)]
    touches: Annotated[list[TouchModel], Field(min_length=1)]
    head: Annotated[int, Field(ge=0, description="Touch in whose time the present is")]
    step: _Step
    view: dict[str, Any] = Field({}, description="What is shown, and how")
    lesson: LessonModel | None = None


@dataclass(frozen=True, eq=False)
class SavedSession:
    """What a session file holds. `step`: the present. `view`: what is shown, and how."""

    document: Document
    head: Node
    step: int
    view: Mapping[str, Any] = field(default_factory=dict)
    lesson: LessonModel | None = None


def session_schema() -> dict[str, Any]:
    """Return the JSON schema of session files."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SessionModel.model_json_schema()}


def save_session(path: Path, document: Document, head: Node, step: int, view: Mapping[str, Any]) -> None:
    """Write a session file, whole or not at all; OutputError when it cannot be written."""
    content = session_json(document, head, step, view)
    with written(path) as part:
        part.write_text(dumped(content), encoding="utf-8")


def dumped(content: Mapping[str, Any]) -> str:
    """Return a session as text: a line for each touch."""
    touches = ",\n  ".join(
        json.dumps(each, ensure_ascii=False, allow_nan=False) for each in content["touches"]
    )
    rest = {key: value for key, value in content.items() if key != "touches"}
    text = json.dumps(rest, ensure_ascii=False, allow_nan=False, indent=1)
    return text.removesuffix("\n}") + f',\n "touches": [\n  {touches}\n ]\n}}\n'


def load_session(path: Path, controllers: Collection[str] = ()) -> SavedSession:
    """Return the content of a session file.

    `controllers` are those of the user's own that may be run. MapError, one line, tells of mistakes: file,
    line and column, JSON path, value and what was wanted; InputError of controllers that may not.
    """
    text, where = read_bytes(path), str(path)
    content = parse(text, where)
    try:
        return session_of(content, where, controllers)
    except MapError as error:
        raise located(error, text, where) from None


def session_of(content: Any, where: str, controllers: Collection[str] = ()) -> SavedSession:
    """Return a session from its JSON; MapError, InputError as `load_session`."""
    check_header(content, where, FORMAT, VERSION)
    try:
        model = SessionModel.model_validate(content)
    except ValidationError as error:
        raise refused(error, where, _mistake) from None
    return _Reader(model, where, controllers).session()


def session_json(document: Document, head: Node, step: int, view: Mapping[str, Any]) -> dict[str, Any]:
    """Return a session as JSON."""
    from robocov import __version__

    maps: list[Any] = []
    touches = [_touch_json(node, maps) for node in document.nodes]
    return {
        "format": FORMAT,
        "version": VERSION,
        "robocov": __version__,
        "maps": maps,
        "touches": touches,
        "head": head.number,
        "step": step,
        "view": dict(view),
    }


# writing


def _touch_json(node: Node, maps: list[Any]) -> dict[str, Any]:
    changes: list[dict[str, Any]] = []
    for step, change in node.changes:
        last = changes[-1] if changes else {}
        if isinstance(change, Drag) and last.get("do") == "drag" and last["robot"] == change.robot:
            last["path"].append([step, *change.to])
        else:
            changes.append({"step": step, **_change_json(step, change, maps)})
    parent = None if node.parent is None else node.parent.number
    named = {"name": node.name} if node.name else {}
    head = {"parent": parent, "at": node.at, "kind": node.kind, "words": node.words, **named}
    curves = {
        f"{pane} {what}": curve.outline(MOST_SAMPLES)
        for (pane, what), curve in node.curves.items()
        if len(curve)
    }
    return {**head, "end": node.end, "changes": changes, **({"curves": curves} if curves else {})}


def _change_json(step: int, change: Change, maps: list[Any]) -> dict[str, Any]:
    match change:
        case Restart(scenario):
            return {"do": "restart", "scenario": _scenario_json(scenario, maps)}
        case Drag(robot, to):
            return {"do": "drag", "robot": robot, "path": [[step, *to]]}
        case Release():
            return {"do": "release"}
        case Place(robot, at) | Join(robot, at):
            return {"do": "place" if isinstance(change, Place) else "join", "robot": robot, "at": [*at]}
        case Leave(robot) | Fail(robot) | Revive(robot):
            return {"do": type(change).__name__.lower(), "robot": robot}
        case EditObstacles(first, removed, added):
            return {
                "do": "obstacles",
                "first": first,
                "removed": removed,
                "added": [plain(each) for each in added],
            }
        case Paint(dabs, radius, lowers):
            return {"do": "paint", "dabs": [[*dab] for dab in dabs], "radius": radius, "lowers": lowers}
        case SetDensity(density):
            return {"do": "density", "density": None if density is None else density_json(density)}
        case SetController(pane, law):
            return {"do": "controller", "pane": pane, "controller": _law_json(law)}
        case SetLimits(limits):
            return {"do": "team", "team": _limits_json(limits)}
        case RemovePane(pane):
            return {"do": "remove-pane", "pane": pane}


def density_json(density: Any) -> Any:
    """Return a density as maps have it."""
    square = Environment("square", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), (), {})
    return to_json(square.with_density(density)).get("density")


def _law_json(law: ControllerChoice) -> dict[str, Any]:
    return {"name": law.name, "gains": dict(law.gains)}


def _limits_json(limits: TeamSpec) -> dict[str, Any]:
    found: dict[str, Any] = {name: _finite(getattr(limits, name)) for name in UNITS}
    if limits.different:
        found["different"] = {
            name: {str(number): _finite(value) for number, value in values}
            for name, values in limits.different
        }
    return found


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _scenario_json(scenario: Scenario, maps: list[Any]) -> dict[str, Any]:
    document = _map_json(scenario.environment)
    if document not in maps:
        maps.append(document)
    given, moving = scenario.given, scenario.moving
    return {
        "map": maps.index(document),
        "controllers": [_law_json(law) for law in scenario.laws],
        "robots": scenario.robots,
        "start": scenario.start,
        "seed": scenario.seed,
        "team": _limits_json(scenario.limits),
        "dt_s": scenario.dt,
        "starts_m": None if given is None else np.asarray(given).tolist(),
        "start_velocities_m_per_s": None if moving is None else np.asarray(moving).tolist(),
        "conditions": None if scenario.conditions is None else scenario.conditions.to_dict(),
    }


@lru_cache(maxsize=8)
def _map_json(environment: Environment) -> dict[str, Any]:
    """Return a bundled map by its name, and another one whole."""
    document = to_json(environment)
    for name, digest in _bundled_digests().items():
        if digest == _digest(document):
            return {"bundled": name, "digest": digest}
    return document


@lru_cache(maxsize=1)
def _bundled_digests() -> dict[str, str]:
    return {name: _digest(to_json(load_map(name))) for name in bundled_maps()}


def _digest(document: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


# reading


class _Reader:
    """Makes a session of its model."""

    def __init__(self, model: SessionModel, where: str, controllers: Collection[str]) -> None:
        self._model, self._where, self._controllers = model, where, controllers
        self._maps: dict[int, Environment] = {}

    def session(self) -> SavedSession:
        """Return the session."""
        touches = self._model.touches
        nodes: list[Node] = []
        for k, touch in enumerate(touches):
            at = "touches", k
            if (touch.parent is None) != (k == 0) or (touch.parent is not None and touch.parent >= k):
                self._refuse((*at, "parent"), touch.parent, "null for the first, else an earlier number,")
            parent = None if touch.parent is None else nodes[touch.parent]
            changes = [
                each
                for m, change in enumerate(touch.changes)
                for each in self._changes(change, (*at, "changes", m))
            ]
            if k == 0 and not isinstance(changes[0][1], Restart):
                self._refuse((*at, "changes", 0, "do"), touch.changes[0].do, '"restart"')
            node = Node(k, parent, touch.at, touch.kind, touch.words, changes, touch.end, touch.name)
            if parent is not None and not parent.begin <= touch.at <= parent.end:
                steps = f"a step of touch {touch.parent}, {parent.begin} to {parent.end},"
                self._refuse((*at, "at"), touch.at, steps)
            steps_of = [node.begin, *(step for step, _ in changes)]
            if steps_of != sorted(steps_of) or steps_of[1] != node.begin or node.end < steps_of[-1]:
                self._refuse((*at, "end"), touch.end, "a step from those of its changes on, in order,")
            for name, samples in touch.curves.items():
                pane, _, what = name.partition(" ")
                if not pane.isdecimal() or what not in ("distance", "time") or len(samples) != 2:
                    self._refuse((*at, "curves"), name, '"0 distance", "0 time", ... with times and values')
                for time, value in zip(*samples, strict=False):
                    node.curves.setdefault((int(pane), what), Curve()).add(time, value)
            nodes.append(node)
        if self._model.head >= len(nodes):
            self._refuse(("head",), self._model.head, f"the number of a touch, 0 to {len(nodes) - 1},")
        head = nodes[self._model.head]
        if not head.begin <= self._model.step <= head.end:
            self._refuse(("step",), self._model.step, f"a step of the head, {head.begin} to {head.end},")
        lesson = self._model.lesson
        for k, chapter in enumerate(lesson.chapters if lesson else ()):
            place, asked = ("lesson", "chapters", k), chapter.question
            if chapter.touch >= len(nodes):
                wanted = f"the number of a touch, 0 to {len(nodes) - 1},"
                self._refuse((*place, "touch"), chapter.touch, wanted)
            if asked is not None and asked.right > len(asked.answers):
                self._refuse((*place, "question", "right"), asked.right, "the number of an answer")
        return SavedSession(Document.of(nodes), head, self._model.step, self._model.view, lesson)

    def _refuse(self, path: tuple[str | int, ...], value: object, wanted: str) -> None:
        words = f"{shown_json(value)}, but {wanted.rstrip(',')} was wanted"
        raise MapError.of(self._where, [Mistake.at(path, words)])

    def _changes(self, change: Any, at: tuple[str | int, ...]) -> list[tuple[int, Change]]:
        step = change.step
        match change:
            case DragModel():
                return [(int(when), Drag(change.robot, (x, y))) for when, x, y in change.path]
            case RestartModel():
                return [(step, Restart(self._scenario(change.scenario, (*at, "scenario"))))]
            case ReleaseModel():
                return [(step, Release())]
            case PlaceModel():
                x, y = change.at
                return [(step, (Place if change.do == "place" else Join)(change.robot, (x, y)))]
            case RobotModel():
                kinds: dict[str, Any] = {"leave": Leave, "fail": Fail, "revive": Revive}
                made: Change = kinds[change.do](change.robot)
                return [(step, made)]
            case ObstaclesModel():
                added = tuple(each.built() for each in change.added)
                return [(step, EditObstacles(change.first, change.removed, added))]
            case PaintModel():
                return [(step, Paint(tuple((x, y) for x, y in change.dabs), change.radius, change.lowers))]
            case DensityChangeModel():
                document = None if change.density is None else change.density.model_dump(exclude_none=True)
                return [(step, SetDensity(self._density(document)))]
            case ControllerChangeModel():
                return [(step, SetController(change.pane, self._law(change.controller, (*at, "controller"))))]
            case TeamChangeModel():
                return [(step, SetLimits(self._limits(change.team)))]
            case _:
                return [(step, RemovePane(change.pane))]

    def _density(self, document: Any) -> Any:
        return None if document is None else density_of(document, self._environment(0).boundary, self._where)

    def _law(self, model: ControllerModel, at: tuple[str | int, ...]) -> ControllerChoice:
        name = model.name
        if name not in CONTROLLERS and name not in self._controllers:
            kind = name.rpartition(":")[2]
            known = [each for each in self._controllers if each.rpartition(":")[2] == kind]
            if not known:
                raise InputError(
                    f"{self._where}: {'.'.join(map(str, at))}: {name!r} is none of robocov's controllers; "
                    f"to run it, open the session with --controller {name}"
                )
            name = known[0]
        gains: dict[str, Value] = dict(model.gains)
        law = ControllerChoice(name, gains)
        try:
            law.made()
        except RobocovError as error:
            raise MapError.of(self._where, [Mistake.at((*at, "gains"), str(error))]) from None
        return law

    def _limits(self, model: TeamModel) -> TeamSpec:
        values = {name: _unlimited(getattr(model, name)) for name in UNITS}
        different = tuple(
            (name, tuple((int(number), _unlimited(value)) for number, value in each.items()))
            for name, each in model.different.items()
        )
        return TeamSpec(**values, different=different)

    def _scenario(self, model: ScenarioModel, at: tuple[str | int, ...]) -> Scenario:
        if model.map >= len(self._model.maps):
            self._refuse((*at, "map"), model.map, f"the number of a map, 0 to {len(self._model.maps) - 1},")
        try:
            return Scenario(
                self._environment(model.map),
                tuple(self._law(law, (*at, "controllers", k)) for k, law in enumerate(model.controllers)),
                model.robots,
                model.start,
                model.seed,
                self._limits(model.team),
                model.dt_s,
                None if model.starts_m is None else np.array(model.starts_m),
                None if model.start_velocities_m_per_s is None else np.array(model.start_velocities_m_per_s),
                None if model.conditions is None else Conditions.from_dict(model.conditions),
            )
        except MapError:
            raise
        except RobocovError as error:
            raise MapError.of(self._where, [Mistake.at(at, str(error))]) from None

    def _environment(self, number: int) -> Environment:
        if number not in self._maps:
            model = self._model.maps[number]
            if not isinstance(model, BundledMapModel):
                try:
                    self._maps[number] = from_json(model)
                except MapError as error:
                    words = f"maps[{number}]: {str(error).removeprefix('map: ')}"
                    raise MapError.of(self._where, [Mistake(("maps", number), words)]) from None
            else:
                if model.bundled not in bundled_maps():
                    self._refuse(("maps", number, "bundled"), model.bundled, "the name of a bundled map")
                found = load_map(model.bundled)
                if _digest(to_json(found)) != model.digest:
                    self._refuse(("maps", number, "digest"), model.digest, "that of the map as it is now")
                self._maps[number] = found
        return self._maps[number]


def _unlimited(value: float | None) -> float:
    return math.inf if value is None else value


def _mistake(detail: Any) -> Mistake:
    """Return one structural error in the project's words: place, value, what was wanted."""
    steps = list(detail["loc"])
    # pydantic names the kind that it has chosen as a step of the path
    tags = [k for k in range(2, len(steps)) if steps[k - 2] in ("changes", "added", "maps", "gains")]
    path = tuple(step for k, step in enumerate(steps) if k not in tags)
    if detail["type"] == "missing":
        return Mistake.at(path, "missing")
    if detail["type"] == "extra_forbidden":
        return Mistake.at(path, "unknown key", at_key=True)
    words = str(detail["msg"]).removeprefix("Input should be ").replace("a valid ", "a ")
    return Mistake.at(path, f"{shown_json(detail['input'])}, but {words} was wanted")
