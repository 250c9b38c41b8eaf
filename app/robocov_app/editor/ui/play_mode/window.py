"""The window of the viewer in play mode, and how it is opened for the map of an editor."""

import math
from dataclasses import replace

import pygame

from robocov.defaults import DEFAULT_LATTICE
from robocov_app.editor.editor import Editor
from robocov_app.editor.ui.play_mode.drafts import PlayDrafts
from robocov_app.editor.ui.play_mode.presenter import PlayPresenter
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.command_bar import BarCell, measure_cells
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import get_key_name
from robocov_app.toolkit.window.page_view import WindowControls
from robocov_app.toolkit.window.window_display import WindowDisplay
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.top_bar import TopBar
from robocov_app.viewer.window.window import ViewerWindow

BACK_COMMAND = "editor"
FIRST_UPDATE_S = 0.01


class PlayTopBar(TopBar):
    """The top bar of the viewer in play mode, which has a button that returns to the editor."""

    def list_left_cells(self, ui: Ui, width: float) -> list[BarCell]:
        """Return the cells at the left end: back to the editor, undo, redo and the file."""
        back = self.build_wide_button(ui, "back", "Editor", command=BACK_COMMAND)
        return [back, *super().list_left_cells(ui, width - measure_cells([back]))]


class PlayWindow(ViewerWindow):
    """The window of the viewer in play mode, in which F5 and Escape return to the editor.

    Attributes
    ----------
    returns_to_editor : bool
        Whether to return to the editor.
    ignored_key : int or None
        The key that started play mode, until it is released. Its repetitions are ignored.
    drafts : PlayDrafts
        Saves drafts of the map.
    """

    viewer: PlayPresenter
    top_bar_class = PlayTopBar
    hint = "F5: back to the editor · F1: keys"

    def __init__(
        self,
        viewer: PlayPresenter,
        drafts: PlayDrafts,
        display: WindowDisplay,
        scale: float | None,
        *,
        is_unattended: bool,
    ) -> None:
        self.returns_to_editor = False
        self.ignored_key: int | None = None
        self.drafts = drafts
        super().__init__(
            viewer, display.surface.get_size(), scale, is_unattended=is_unattended, display=display
        )

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event; F5 returns to the editor."""
        is_released = event.type == pygame.KEYUP and event.key == self.ignored_key
        if event.type == pygame.WINDOWFOCUSLOST or is_released:
            self.ignored_key = None
        if event.type == pygame.KEYDOWN and event.key == self.ignored_key:
            return
        if event.type == pygame.KEYDOWN and get_key_name(event) == "f5":
            self.return_to_editor()
        else:
            super().handle_event(event)

    def list_more_commands(self) -> list[Command]:
        """Return the command that leads back to the editor."""
        return [Command(BACK_COMMAND, "Back to the editor", "File", self.return_to_editor, ("f5",))]

    @property
    def controls(self) -> WindowControls:
        """State that the buttons of a phone's page show; one of them leads back to the editor."""
        return replace(super().controls, kind="trial")

    def return_to_editor(self) -> None:
        """Return to the editor at the end of the frame."""
        self.returns_to_editor = True

    def save_draft(self, *, force: bool = False) -> None:
        """Save a draft of the map with the changes made here, unless another map was opened."""
        if not self.viewer.files.has_left_edited_map:
            self.drafts.save(self.viewer.session.displayed.environment, force=force)

    def run_command(self, name: str) -> None:
        """Run a command; Escape returns to the editor if there is nothing to cancel."""
        is_open = self.help_page.is_open or self.dialogs.is_open or self.lesson.player is not None
        viewer = self.viewer
        drag_tool = viewer.toolbox.hand
        is_idle = not is_open and viewer.tool is drag_tool and viewer.selected_robot is None
        if name == "cancel" and is_idle:
            self.returns_to_editor = not drag_tool.cancel(viewer.session)
        else:
            super().run_command(name)


def open_play_window(
    editor: Editor, display: WindowDisplay, scale: float | None, *, waits_for_workers: bool
) -> PlayWindow:
    """Open the map of an editor in the viewer.

    Parameters
    ----------
    editor : Editor
        The editor.
    display : WindowDisplay
        Display of the window in which the viewer is shown.
    scale : float or None
        Size of text and widgets; None for one that suits the size of the window.
    waits_for_workers : bool
        Whether to wait for computations instead of running them in the background.

    Raises
    ------
    MapError
        If the map breaks a rule.
    """
    environment = editor.sketch.build_environment()
    start = None
    if editor.start_name in environment.starts:
        start = editor.start_name
    scenario = SessionScenario(
        environment,
        robots=editor.robots,
        start=start,
        seed=editor.seed,
        properties=RobotProperties(radius=editor.radius),
    )
    session = Session(scenario)
    if waits_for_workers:
        # The simulation may take as long as it needs in each frame.
        session.playback.clock.budget = math.inf
    costs = Costs(DEFAULT_LATTICE, direct=waits_for_workers)
    try:
        shown = {layer.name for layer in build_standard_layers() if layer.is_default}
        viewer = PlayPresenter(session, costs, shown, editor.folder, editor.document.title)
        viewer.view.theme = editor.theme
        drafts = PlayDrafts(editor.document, viewer.files.edited_map)
        play_window = PlayWindow(viewer, drafts, display, scale, is_unattended=waits_for_workers)
    except BaseException:
        costs.close()
        raise
    # Without this update, the first frame would have no panel.
    play_window.panel.update(FIRST_UPDATE_S)
    way_back = "tap Editor to return" if editor.is_compact else "F5 or Esc returns to the editor"
    viewer.show_message(f"trying “{editor.sketch.name}”: {way_back}")
    return play_window
