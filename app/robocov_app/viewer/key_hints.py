"""Hints on how to continue: by a key at a computer, by a button of the page on a phone."""

from robocov_app.viewer.view import ViewState


def explain_pause(view: ViewState) -> str:
    """Return a hint that an opened session is paused."""
    return _choose_hint(
        view,
        phone="It is paused: tap Play to continue.",
        computer="It is paused: press Space or Play to continue.",
    )


def explain_download(view: ViewState) -> str:
    """Return a hint on how to download a file that was saved in a browser."""
    return _choose_hint(
        view,
        phone="More → Download copies it to your device.",
        computer="Download copies it to your device.",
    )


def explain_kept_session(view: ViewState) -> str:
    """Return a hint that the session before the opened one is kept as a draft."""
    return f"Your unsaved session is kept: {_explain_recovery(view)}"


def explain_kept_edits(view: ViewState) -> str:
    """Return a hint that the user's edits after taking over from a lesson are kept as a draft."""
    return f"What you have changed is kept: {_explain_recovery(view)}"


def _explain_recovery(view: ViewState) -> str:
    return _choose_hint(
        view, phone="More → Commands → Recover a session opens it.", computer="Ctrl+Shift+O opens it."
    )


def explain_lesson_start(view: ViewState) -> str:
    """Return a hint on how to play the lesson of an opened file."""
    return _choose_hint(view, phone="Lesson plays its lesson.", computer="F2 plays its lesson.")


def explain_lesson_repetition(view: ViewState) -> str:
    """Return a hint on how to play a lesson again that has ended."""
    return _choose_hint(view, phone="Lesson plays it again", computer="F2 plays it again")


def explain_answering(view: ViewState) -> str:
    """Return a hint on how to answer the question of a lesson."""
    return _choose_hint(
        view,
        phone="answer first: tap your answer",
        computer="answer first: press the number of your answer, or click it",
    )


def explain_chapter_end(view: ViewState) -> str:
    """Return a hint on how to continue after a chapter of a lesson that has ended."""
    return _choose_hint(
        view,
        phone="this chapter is over: tap Next to continue",
        computer="this chapter is over: press → or click Next to continue",
    )


def explain_record_end(view: ViewState) -> str:
    """Return a hint on how to simulate beyond the end of a record."""
    return _choose_hint(
        view,
        phone="the record ends here; Play continues by simulating",
        computer="the record ends here; Space continues by simulating",
    )


def _choose_hint(view: ViewState, *, phone: str, computer: str) -> str:
    """Return the hint for the page of a phone, which has buttons, or for a computer, which has keys."""
    if view.is_compact:
        return phone
    return computer
