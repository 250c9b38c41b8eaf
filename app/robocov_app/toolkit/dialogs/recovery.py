"""The question whether to recover work that a window has left behind unsaved."""

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
    """Create the question.

    Parameters
    ----------
    text : str
        Describes the unsaved work.
    others : int
        Number of other windows whose work is unsaved, too.
    recover, discard : callable
        Opens the work, or removes it.
    postpone : callable
        Called if the work is kept to be offered again, also if the question is canceled.

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
