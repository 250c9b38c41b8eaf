"""Checks of a lesson against its session: edits, robots, answers and conditions that exist."""

from collections.abc import Iterable, Sequence

from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.editing.edits import AddRobot, Restart
from robocov_app.viewer.session.files.maps import reject_value
from robocov_app.viewer.session.files.models import ChapterModel, ConditionModel, LessonModel

_Path = tuple[str | int, ...]


def check_lesson_references(lesson: LessonModel, source_name: str, nodes: Sequence[Node]) -> None:
    """Check that the chapters of a lesson refer only to existing edits and robots, and that they can end.

    Parameters
    ----------
    lesson : LessonModel
        The lesson.
    source_name : str
        Name of the file, for messages.
    nodes : sequence of Node
        The edits of the session.

    Raises
    ------
    MapError
        If an edit, a robot or an answer does not exist, or a condition cannot be fulfilled.
    """
    robot_count = count_robots(nodes)
    for index, chapter in enumerate(lesson.chapters):
        path: _Path = ("lesson", "chapters", index)
        if chapter.edit >= len(nodes):
            expected = f"the index of an edit, 0 to {len(nodes) - 1}"
            reject_value(source_name, (*path, "edit"), chapter.edit, expected)
        _check_answer(chapter, source_name, path)
        _check_robot(chapter.robot, source_name, (*path, "robot"), robot_count)
        _check_condition(chapter.until, source_name, (*path, "until"), robot_count)
        if chapter.task is not None:
            _check_condition(chapter.task.until, source_name, (*path, "task", "until"), robot_count)


def count_robots(nodes: Iterable[Node]) -> int:
    """Return the highest number that a robot has anywhere in a session."""
    count = 0
    for node in nodes:
        for edit in node.edits:
            if isinstance(edit, Restart):
                count = max(count, edit.scenario.robots)
            elif isinstance(edit, AddRobot):
                count = max(count, edit.robot)
    return count


def _check_answer(chapter: ChapterModel, source_name: str, path: _Path) -> None:
    question = chapter.question
    if question is not None and question.right > len(question.answers):
        expected = f"the number of an answer, 1 to {len(question.answers)}"
        reject_value(source_name, (*path, "question", "right"), question.right, expected)


def _check_robot(robot: int | None, source_name: str, path: _Path, robot_count: int) -> None:
    if robot is not None and robot > robot_count:
        reject_value(source_name, path, robot, f"a robot of the session, 1 to {robot_count}")


def _check_condition(condition: ConditionModel, source_name: str, path: _Path, robot_count: int) -> None:
    """Check that a condition is not empty, has a robot and a box or neither, and that these are valid."""
    boxes = {"inside": condition.inside, "outside": condition.outside}
    has_box = any(box is not None for box in boxes.values())
    has_robot = condition.robot is not None
    content = condition.model_dump(exclude_none=True)
    if not content or has_robot != has_box:
        expected = '"step", "settled", "mean_distance_below", or "robot" with "inside" or "outside"'
        reject_value(source_name, path, content, expected)
    _check_robot(condition.robot, source_name, (*path, "robot"), robot_count)
    for name, box in boxes.items():
        if box is not None and not (box[0] < box[2] and box[1] < box[3]):
            reject_value(source_name, (*path, name), box, "[left, bottom, right, top]")
