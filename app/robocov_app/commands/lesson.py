"""`robocov lesson`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from robocov_app.commands.options import JsonOption
from robocov_app.terminal.output import print_answer


@dataclass
class Arguments(JsonOption):
    """Check a lesson: a session file with chapters, which `robocov demo --lesson FILE` plays.

    Play what a chapter is to show in the window, save the session (Ctrl S), and write "lesson" into the file:
    a title and chapters, each with title, text, the touch at which it ends, and until when (robocov schema
    session tells the rest); with a question or a task where that teaches. All chapters are simulated.

    Example: robocov lesson check mine.robocov
    """

    action: tyro.conf.Positional[Literal["check"]]
    """What to do."""
    file: tyro.conf.Positional[Path]
    """The lesson."""


def command(options: Arguments) -> int:
    from robocov.kernel_compilation import compile_kernels
    from robocov_app.viewer.lessons import checked, load_lesson

    saved = load_lesson(options.file)
    assert saved.lesson is not None
    compile_kernels()
    chapters = checked(saved)
    rows, lines = [], [saved.lesson.title]
    for k, (title, seconds, ends) in enumerate(chapters, 1):
        rows.append({"title": title, "seconds": seconds, "ends": ends})
        lines.append(f"  {k:2}  {title:44}  {f'ends after {seconds:.1f} s' if ends else 'never ends'}")
    print_answer(options, {"title": saved.lesson.title, "chapters": rows}, *lines)
    return 0 if all(ends for *_, ends in chapters) else 2
