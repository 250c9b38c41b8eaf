"""Session files, ``NAME.robocov``: the document of a session as versioned JSON of a few kilobytes.

Bundled maps are stored by name and digest, other maps in full; each map is stored once. A controller in a
user's file is stored by its path, and is never loaded just because a session file names it.
"""

import json
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from robocov.errors import Issue, MapError, quote_json
from robocov.files.documents import build_document_error, check_header
from robocov.files.strictjson import locate_issues, parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov_app.viewer.session.document import Node, SessionDocument
from robocov_app.viewer.session.editing.edits import DragRobot, Restart, SessionEdit
from robocov_app.viewer.session.files.lesson_checks import check_lesson_references
from robocov_app.viewer.session.files.maps import FileContext, reject_value
from robocov_app.viewer.session.files.models import LessonModel, NodeModel, SessionModel

FORMAT = "robocov-session"
VERSION = 1
SUFFIX = ".robocov"
MAX_FILE_SAMPLES = 30
"""Maximum number of samples of a curve per node in a file."""
_EDIT_WRITER: TypeAdapter[SessionEdit] = TypeAdapter(SessionEdit)
# Message of pydantic for an unknown kind of edit or obstacle.
_UNKNOWN_TAG = re.compile(
    r"Input tag '(?P<found>.*?)' found using '(?P<key>\w+)' .* expected tags: (?P<known>.*)"
)
# Rewrites of messages of pydantic, from "Input should be a valid integer" to "an integer", for example.
_REWRITES = (
    (r"^Input should be ", ""),
    (r"a valid integer", "an integer"),
    (r"a valid ", "a "),
    (r".* should have (.*?)( after validation)?(, not \d+)?$", r"\1"),
)
# In the location of a validation error, pydantic inserts the kind of item that it has chosen two places after
# each of these keys: after the key itself and an index or a name.
_STEPS_BEFORE_KIND = ("changes", "added", "maps", "gains")


@dataclass(frozen=True, eq=False)
class SavedSession:
    """Content of a session file.

    Attributes
    ----------
    document : SessionDocument
        The tree of edits.
    head : Node
        The node whose time span contains the present.
    step : int
        The present step.
    view : mapping
        Displayed layers and theme.
    """

    document: SessionDocument
    head: Node
    step: int
    view: Mapping[str, Any] = field(default_factory=dict)

    @property
    def lesson(self) -> LessonModel | None:
        """The chapters, if the session is a lesson."""
        return self.document.lesson


def save_session(
    path: Path, document: SessionDocument, head: Node, step: int, view: Mapping[str, Any]
) -> None:
    """Write a session file. If writing fails, an existing file stays unchanged.

    Parameters
    ----------
    path : Path
        The file.
    document : SessionDocument
        The edits.
    head : Node
        The node whose time span contains the present.
    step : int
        The present step.
    view : mapping
        Displayed layers and theme.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    content = build_session_content(document, head, step, view)
    with replace_file(path) as temporary:
        temporary.write_text(format_session(content), encoding="utf-8")


def format_session(content: Mapping[str, Any]) -> str:
    """Format the content of a session file as JSON, with one line for each node."""
    nodes = [json.dumps(node, ensure_ascii=False, allow_nan=False) for node in content["edits"]]
    other_content = {key: value for key, value in content.items() if key != "edits"}
    text = json.dumps(other_content, ensure_ascii=False, allow_nan=False, indent=1)
    lines = ",\n  ".join(nodes)
    return text.removesuffix("\n}") + f',\n "edits": [\n  {lines}\n ]\n}}\n'


def build_session_content(
    document: SessionDocument, head: Node, step: int, view: Mapping[str, Any]
) -> dict[str, Any]:
    """Build the content of a session file; see `save_session` for the parameters."""
    from robocov import __version__

    context = FileContext()
    nodes = [_build_node_content(node, context) for node in document.nodes]
    content = {
        "format": FORMAT,
        "version": VERSION,
        "robocov": __version__,
        "maps": context.maps,
        "edits": nodes,
        "head": head.number,
        "step": step,
        "view": dict(view),
    }
    if document.lesson is not None:
        content["lesson"] = document.lesson.model_dump(mode="json", exclude_unset=True)
    return content


def _build_node_content(node: Node, context: FileContext) -> dict[str, Any]:
    """Build the content of a node; optional entries are left out if they are empty."""
    content: dict[str, Any] = {
        "parent": None if node.parent is None else node.parent.number,
        "at": node.branch_step,
        "kind": node.kind,
        "description": node.description,
    }
    if node.name:
        content["name"] = node.name
    content["end"] = node.last_step
    content["changes"] = _build_edits_content(node.edits, context)
    curves = {}
    for (pane, quantity), curve in node.curves.items():
        if len(curve):
            curves[f"{pane} {quantity}"] = curve.sample(MAX_FILE_SAMPLES)
    if curves:
        content["curves"] = curves
    return content


def _build_edits_content(edits: list[SessionEdit], context: FileContext) -> list[dict[str, Any]]:
    """Build the content of edits; consecutive points of a drag are merged to one path."""
    contents: list[dict[str, Any]] = []
    for edit in edits:
        if not isinstance(edit, DragRobot):
            contents.append(_EDIT_WRITER.dump_python(edit, mode="json", by_alias=True, context=context))
            continue
        continues_path = (
            bool(contents) and contents[-1]["do"] == "drag" and contents[-1]["robot"] == edit.robot
        )
        if not continues_path:
            contents.append({"step": edit.step, "do": "drag", "robot": edit.robot, "path": []})
        contents[-1]["path"].append([edit.step, *edit.to])
    return contents


def load_session(path: Path, controllers: Collection[str] = ()) -> SavedSession:
    """Read a session file.

    Parameters
    ----------
    path : Path
        The file.
    controllers : collection of str
        Controllers in users' files that may be loaded, as the user has named them.

    Returns
    -------
    SavedSession

    Raises
    ------
    MapError
        If the file cannot be used. The message names the file, line and column, and the JSON path.
    """
    text = read_bytes(path)
    source_name = str(path)
    content = parse_json(text, source_name)
    try:
        return parse_session(content, source_name, controllers)
    except MapError as error:
        raise locate_issues(error, text, source_name) from None


def parse_session(content: Any, source_name: str, controllers: Collection[str] = ()) -> SavedSession:
    """Read the content of a session file.

    Parameters
    ----------
    content : object
        The JSON content.
    source_name : str
        Name of the file, for messages.
    controllers : collection of str
        Controllers in users' files that may be loaded, as the user has named them.

    Returns
    -------
    SavedSession

    Raises
    ------
    MapError
        If the content cannot be used.
    """
    check_header(content, source_name, FORMAT, VERSION)
    try:
        model = SessionModel.model_validate(content, context=FileContext(source_name, controllers))
    except ValidationError as error:
        raise build_document_error(error, source_name, _build_issue) from None
    nodes: list[Node] = []
    for node_model in model.edits:
        nodes.append(_NodeReader(source_name, nodes).read(node_model))
    if model.head >= len(nodes):
        reject_value(source_name, ("head",), model.head, f"the index of an edit, 0 to {len(nodes) - 1}")
    head = nodes[model.head]
    if not head.first_step <= model.step <= head.last_step:
        expected = f"a step of the head, {head.first_step} to {head.last_step}"
        reject_value(source_name, ("step",), model.step, expected)
    if model.lesson is not None:
        check_lesson_references(model.lesson, source_name, nodes)
    return SavedSession(SessionDocument(nodes, model.lesson), head, model.step, model.view)


class _NodeReader:
    """Builds the next node of a session file from its model.

    Parameters
    ----------
    source_name : str
        Name of the file, for messages.
    nodes : list of Node
        The earlier nodes.
    """

    def __init__(self, source_name: str, nodes: list[Node]) -> None:
        self._source_name = source_name
        self._nodes = nodes

    def read(self, model: NodeModel) -> Node:
        """Build the node, or raise a MapError."""
        self._check_parent(model)
        if not self._nodes and not isinstance(model.changes[0], Restart):
            self._reject(("changes", 0, "do"), model.changes[0].do, '"restart"')
        node = Node(
            len(self._nodes),
            None if model.parent is None else self._nodes[model.parent],
            model.at,
            model.kind,
            model.description,
            model.to_edits(),
            model.end,
            model.name,
        )
        self._check_steps(model, node)
        self._read_curves(model, node)
        return node

    def _reject(self, path: tuple[str | int, ...], value: object, expected: str) -> None:
        reject_value(self._source_name, ("edits", len(self._nodes), *path), value, expected)

    def _check_parent(self, model: NodeModel) -> None:
        is_first = not self._nodes
        is_root = model.parent is None
        is_unknown = model.parent is not None and model.parent >= len(self._nodes)
        if is_root != is_first or is_unknown:
            self._reject(("parent",), model.parent, "null for the first, or the index of an earlier edit")

    def _check_steps(self, model: NodeModel, node: Node) -> None:
        parent = node.parent
        if parent is not None and not parent.first_step <= model.at <= parent.last_step:
            steps = f"{parent.first_step} to {parent.last_step}"
            self._reject(("at",), model.at, f"a step of edit {model.parent}, {steps}")
        edit_steps = [edit.step for edit in node.edits]
        is_ordered = edit_steps == sorted(edit_steps) and edit_steps[0] == node.first_step
        if not is_ordered or node.last_step < edit_steps[-1]:
            self._reject(("end",), model.end, "a step at or after its changes, whose steps must ascend")

    def _read_curves(self, model: NodeModel, node: Node) -> None:
        for name, samples in model.curves.items():
            pane, _, quantity = name.partition(" ")
            if not pane.isdecimal() or quantity not in ("distance", "time") or len(samples) != 2:
                self._reject(("curves",), name, '"0 distance", "0 time", ... with times and values')
            times, values = samples
            for time, value in zip(times, values, strict=False):
                node.curves[int(pane), quantity].add(time, value)


def _build_issue(detail: Any) -> Issue:
    """Convert an error of pydantic to a robocov `Issue` with a path and a plain message."""
    steps = list(detail["loc"])
    # Remove the kinds that pydantic has inserted, because they are not part of the JSON path.
    kind_indices = [index for index in range(2, len(steps)) if steps[index - 2] in _STEPS_BEFORE_KIND]
    path = tuple(step for index, step in enumerate(steps) if index not in kind_indices)
    message = str(detail["msg"])
    match detail["type"]:
        case "missing":
            return Issue.at_path(path, "missing")
        case "invalid":
            return Issue.at_path(path, message)
        case "extra_forbidden":
            return Issue.at_path(path, "unknown key", at_key=True)
        case "union_tag_not_found":
            return Issue.at_path((*path, "do"), "missing")
        case "model_type" | "dataclass_type" | "model_attributes_type":
            return Issue.at_path(path, f"expected an object, got {quote_json(detail['input'])}")
    unknown_tag = _UNKNOWN_TAG.match(message)
    if unknown_tag is not None:
        expected = f"one of {unknown_tag['known']}"
        found = quote_json(unknown_tag["found"])
        return Issue.at_path((*path, unknown_tag["key"]), f"expected {expected}, got {found}")
    expected = message
    for pattern, replacement in _REWRITES:
        expected = re.sub(pattern, replacement, expected)
    return Issue.at_path(path, f"expected {expected}, got {quote_json(detail['input'])}")
