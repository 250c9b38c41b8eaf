"""`robocov lesson`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro


@dataclass
class Arguments:
    """Check a lesson: a session of the window with chapters that wait, ask and hand over.

    Example: robocov lesson check mine.json
    """

    action: tyro.conf.Positional[Literal["check"]]
    """What to do."""

    file: tyro.conf.Positional[Path]
    """The lesson."""

    controller: tuple[str, ...] = ()
    """Controllers of your own that the lesson may run, as mine.py:MyController."""

    json: bool = False
    """Print one JSON object and nothing else."""


def command(options: Arguments) -> None:
    """Check a lesson, and say what is in it."""
    from robocov.controllers import controller_kinds
    from robocov_app.viewer.lessons import load_lesson

    lesson = load_lesson(options.file, (*controller_kinds(), *options.controller))
    if options.json:
        told = [{"title": chapter.title, "steps": len(chapter.steps)} for chapter in lesson.chapters]
        print(json.dumps({"title": lesson.model.title, "chapters": told}, indent=1))
        return
    print(f"{options.file}: {lesson.model.title}, valid, {len(lesson.chapters)} chapters")
    for k, chapter in enumerate(lesson.chapters, 1):
        print(f"  {k:2}  {chapter.title}")
