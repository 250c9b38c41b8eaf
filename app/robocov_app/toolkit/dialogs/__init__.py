"""Dialogs over a window: questions with answers, lists that are filtered by typing, files.

- `dialog`, `dialogs`: the base class, and the object that passes events to the open dialog
- `question`, `choice`, `file_choice`, `recovery`: the kinds of dialogs
"""

from robocov_app.toolkit.dialogs.choice import Choice, Option, create_list_choice
from robocov_app.toolkit.dialogs.dialog import Dialog
from robocov_app.toolkit.dialogs.dialogs import Dialogs
from robocov_app.toolkit.dialogs.file_choice import MAX_FOLDER_ENTRIES, create_file_choice
from robocov_app.toolkit.dialogs.question import Answer, Question
from robocov_app.toolkit.dialogs.recovery import create_recovery_question

__all__ = [
    "MAX_FOLDER_ENTRIES",
    "Answer",
    "Choice",
    "Dialog",
    "Dialogs",
    "Option",
    "Question",
    "create_file_choice",
    "create_list_choice",
    "create_recovery_question",
]
