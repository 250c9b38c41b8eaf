"""`robocov lesson`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from robocov_app.commands.options import JsonOption
from robocov_app.terminal.output import print_answer

_NEVER_ENDS = 2
"""Exit status if a chapter never ends."""


@dataclass
class Arguments(JsonOption):
    """Check a lesson: a session file with chapters, played by `robocov demo --lesson FILE`.

    In the window, play what the chapters should show, save the session (Ctrl+S), and add "lesson" to the
    file: a title and chapters. Each chapter has a title, a text, the index of its last edit and the condition
    at which it ends; a question or a task may be added (see robocov schema session). All chapters are
    simulated.

    Example: robocov lesson check mine.robocov
    """

    action: tyro.conf.Positional[Literal["check"]]
    """Validate the lesson, and print how each chapter ends."""
    file: tyro.conf.Positional[Path]
    """Lesson file."""


def command(options: Arguments) -> int:
    """Run `robocov lesson`, and return its exit status."""
    from robocov.kernel_compilation import compile_kernels
    from robocov_app.viewer.lessons.player import check_lesson, load_lesson

    saved = load_lesson(options.file)
    assert saved.lesson is not None
    compile_kernels()
    chapters = check_lesson(options.file, saved)
    rows = []
    lines = [saved.lesson.title]
    for number, chapter in enumerate(chapters, start=1):
        rows.append({"title": chapter.title, "seconds": chapter.duration, "ends": chapter.ends})
        end = "never ends"
        if chapter.ends:
            end = f"ends after {chapter.duration:.1f} s"
        lines.append(f"  {number:2}  {chapter.title:44}  {end}")
    print_answer(options, {"title": saved.lesson.title, "chapters": rows}, *lines)
    if not all(chapter.ends for chapter in chapters):
        return _NEVER_ENDS
    return 0
