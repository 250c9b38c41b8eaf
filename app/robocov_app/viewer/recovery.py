"""The offer to recover unsaved sessions, on the start page and in the window."""

from collections.abc import Callable, Sequence
from functools import partial

from robocov_app.storage.autosave import Draft, remove_draft
from robocov_app.toolkit.dialogs import Dialogs, create_recovery_question
from robocov_app.viewer.session.files.drafts import describe_draft


def offer_recovery(dialogs: Dialogs, drafts: Sequence[Draft], recover: Callable[[Draft], object]) -> None:
    """Open a dialog that offers to recover unsaved work.

    Parameters
    ----------
    dialogs : Dialogs
        Shows the open dialog.
    drafts : sequence of Draft
        Drafts of unsaved work, newest first. If the newest one is discarded, the next one is offered.
    recover : callable
        Opens a draft.
    """
    newest = drafts[0]
    others = drafts[1:]

    def discard() -> None:
        remove_draft(newest.folder)
        if others:
            offer_recovery(dialogs, others, recover)

    question = create_recovery_question(
        f"{describe_draft(newest)}.",
        other_count=len(others),
        recover=partial(recover, newest),
        discard=discard,
        postpone=lambda: None,
    )
    dialogs.ask(question)
