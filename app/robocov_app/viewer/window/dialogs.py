"""Dialogs of the window: files, branches, and the offer of the lesson when the window is opened."""

from collections.abc import Callable, Iterator
from pathlib import Path

from robocov_app.toolkit.dialogs import (
    Answer,
    Choice,
    Option,
    Question,
    create_file_choice,
    create_list_choice,
)
from robocov_app.viewer.panel.panel import describe_controllers, label_controllers
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.files.session_file import SUFFIX
from robocov_app.viewer.session.setup.scenario import require_space_for_pane


def build_file_dialog(viewer: Presenter) -> Choice:
    """Return the dialog that opens a session or a map."""
    files = viewer.files
    recent = [Path(name) for name in files.recent if Path(name).exists()]
    return create_file_choice(
        "Open a session or a map",
        files.folder,
        files.open_file,
        suffixes=(SUFFIX, ".json"),
        recent=recent,
        hides_folder=viewer.hidden_folder is not None,
    )


def build_branch_dialog(viewer: Presenter) -> Choice:
    """Return the dialog that enters a branch."""
    timeline = viewer.session.timeline
    # The list shows the costs of all branches, so store those of the present branch in the document, too.
    timeline.cache_present()

    def list_options() -> Iterator[Option]:
        for number, branch in enumerate(timeline.document.list_branches(), 1):
            text = f"{number}  {branch.description}"
            if branch.node is timeline.head:
                text += "  (here)"
            yield Option(text, branch.describe_end(timeline.scenario.dt), value=branch.node.number)

    def enter(option: Option) -> None:
        viewer.playback.go_to_node(int(str(option.value)))

    return create_list_choice("Branches", list_options, enter)


def build_comparison_dialog(viewer: Presenter) -> Choice:
    """Return the dialog that adds a controller to the comparison.

    Raises
    ------
    ParameterError
        If no more controllers fit next to each other.
    """
    panes = viewer.session.timeline.panes
    require_space_for_pane(len(panes))
    # The panes restart with their present controllers, even if the displayed past has others.
    choices = [pane.controller for pane in panes]
    shown_labels = {choice.name: choice.label for choice in choices}
    labels = label_controllers(viewer.controllers, shown_labels)
    descriptions = describe_controllers(viewer.controllers, shown_labels)
    options: list[Option] = []
    for name in viewer.comparison.list_candidates():
        note = "already shown" if name in shown_labels else ""
        options.append(Option(labels[name], note, value=name, description=descriptions[name]))

    def add(option: Option) -> None:
        viewer.comparison.add_pane(str(option.value))

    others = " and ".join(choice.label for choice in choices)
    title = f"Compare {others} with… All start at 0 s; undo returns to this run."
    return create_list_choice(title, lambda: options, add)


def build_lesson_offer(start_lesson: Callable[[], None]) -> Question:
    """Return the dialog that offers the lesson to a new user.

    The session waits while the dialog is open, and runs if the user declines, as after every other start.
    """
    text = (
        "A team of robots spreads over a map that it does not know. The lesson shows what holds it back "
        "and what helps, in a few minutes. Reopen it any time with F2."
    )
    answers = [Answer("Start the lesson", start_lesson), Answer("Explore on my own")]
    return Question("Welcome to robocov", text, answers)
