"""The question whether to recover unsaved work of an earlier window."""

from collections.abc import Callable

from robocov_app.toolkit.dialogs.question import Answer, Question


def create_recovery_question(
    text: str,
    *,
    others: int,
    recover: Callable[[], object],
    discard: Callable[[], object],
    postpone: Callable[[], object],
) -> Question:
    """Create the question whether to recover unsaved work.

    Parameters
    ----------
    text : str
        Describes the unsaved work.
    others : int
        Number of other windows that left unsaved work, too.
    recover, discard : callable
        Open the unsaved work, and delete it.
    postpone : callable
        Called if the work is kept and will be offered again; also if the question is canceled.

    Returns
    -------
    Question
    """
    if others:
        verb = "is" if others == 1 else "are"
        text += f"\n{others} more {verb} kept."
    answers = [
        Answer("Recover", recover, "r"),
        Answer("Discard", discard, "d"),
        Answer("Later", postpone, "l"),
    ]
    return Question("Recover unsaved work?", text, answers, postpone)
