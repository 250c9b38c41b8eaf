"""The question whether to recover unsaved work of an earlier window."""

from collections.abc import Callable

from robocov_app.toolkit.dialogs.question import Answer, Question


def create_recovery_question(
    text: str,
    *,
    other_count: int,
    recover: Callable[[], object],
    discard: Callable[[], object],
    postpone: Callable[[], object],
) -> Question:
    """Create the question whether to recover unsaved work.

    Parameters
    ----------
    text : str
        Describes the unsaved work.
    other_count : int
        Number of other windows that left unsaved work, too.
    recover, discard : callable
        Open the unsaved work, and delete it.
    postpone : callable
        Called if the work is kept and will be offered again; also if the question is canceled.

    Returns
    -------
    Question
    """
    if other_count == 1:
        text += "\n1 more draft is available."
    elif other_count > 1:
        text += f"\n{other_count} more drafts are available."
    answers = [
        Answer("Recover", recover, "r"),
        Answer("Discard", discard, "d"),
        Answer("Later", postpone, "l"),
    ]
    return Question("Recover unsaved work?", text, answers, postpone)
