"""Play mode: the viewer opens the edited map in the same window, and later returns to the editor."""

import math
from dataclasses import replace
from pathlib import Path
from time import monotonic

import pygame

from robocov.controllers import list_controller_classes
from robocov.defaults import DEFAULT_LATTICE
from robocov.environment import Environment
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.command_bar import BarCell, measure_cells
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import get_key_name
from robocov_app.viewer.actions.files import FileActions
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window.top_bar import TopBar
from robocov_app.viewer.window.window import ViewerWindow

BACK_COMMAND = "editor"
DRAFT_PAUSE_S = 1.0  # minimum time between two drafts of a map in play mode
FIRST_UPDATE_S = 0.01


class PlayFiles(FileActions):
    """The file actions of the viewer, which also offer the edited map by its title.

    Attributes
    ----------
    edited_map : Environment
        The map as it was in the editor.
    has_left_edited_map : bool
        Whether another map is open in the viewer.
    """

    def __init__(self, viewer: Presenter, folder: Path, title: str) -> None:
        super().__init__(viewer, folder, map_name=title)
        self.edited_map = viewer.session.displayed.environment
        self.has_left_edited_map = False
        self._title = title

    def open_map(self, name: str) -> None:
        """Open a map by name, or the edited map by its title."""
        if name == self._title:
            self._viewer.session.restart(environment=self.edited_map)
            self.map_name = name
        else:
            super().open_map(name)
        self.has_left_edited_map = name != self._title

    def list_maps(self) -> list[str]:
        """Return the names of the maps that can be opened."""
        return list(dict.fromkeys([self._title, *super().list_maps()]))


class PlayPresenter(Presenter):
    """The presenter of the viewer in play mode."""

    files: PlayFiles

    def __init__(self, session: Session, costs: Costs, layers: set[str], folder: Path, title: str) -> None:
        super().__init__(session, costs, layers, folder, title, controllers=list_controller_classes())
        self.files = PlayFiles(self, folder, title)


class PlayTopBar(TopBar):
    """The top bar of the viewer in play mode, which has a button that leads back to the editor."""

    def list_left_cells(self, ui: Ui, width: float) -> list[BarCell]:
        """Return the cells at the left end: the way back, undo, redo and the file."""
        back = self.build_wide_button(ui, "back", "Editor", command=BACK_COMMAND)
        return [back, *super().list_left_cells(ui, width - measure_cells([back]))]


class PlayDrafts:
    """Saves drafts of the edited map with the changes made in the viewer, at most once a second.

    Parameters
    ----------
    document : Document
        Document of the edited map.
    edited_map : Environment
        The map as it was in the editor.
    """

    def __init__(self, document: Document, edited_map: Environment) -> None:
        self._document = document
        self._edited_map = edited_map
        self._drafted = edited_map
        self._due = 0.0

    def save(self, environment: Environment, *, force: bool) -> None:
        """Save a draft if the map has changed; with `force`, even soon after the previous one."""
        now = monotonic()
        if environment is self._drafted or (now < self._due and not force):
            return
        self._drafted = environment
        self._due = now + DRAFT_PAUSE_S
        change = build_play_change(self._document.history.sketch, self._edited_map, environment)
        if change is None:
            self._document.update_draft()
        else:
            self._document.save_draft(change.sketch)


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
    hint = "F5 back to the editor · F1 keys"

    def __init__(
        self,
        viewer: PlayPresenter,
        drafts: PlayDrafts,
        screen: pygame.Surface,
        scale: float,
        *,
        is_unattended: bool,
    ) -> None:
        self.returns_to_editor = False
        self.ignored_key: int | None = None
        self.drafts = drafts
        super().__init__(viewer, screen.get_size(), scale, is_unattended=is_unattended, screen=screen)

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

    def build_top_bar(self, viewer: Presenter) -> TopBar:
        """Build the top bar with a button that leads back to the editor."""
        return PlayTopBar(viewer, self.commands, self.do)

    def return_to_editor(self) -> None:
        """Return to the editor at the end of the frame."""
        self.returns_to_editor = True

    def save_draft(self, *, force: bool = False) -> None:
        """Save a draft of the map with the changes made here, unless another map was opened."""
        if not self.viewer.files.has_left_edited_map:
            self.drafts.save(self.viewer.session.displayed.environment, force=force)

    def do(self, name: str) -> None:
        """Run a command; Escape returns to the editor if there is nothing to cancel."""
        is_open = self.is_help_open or self.dialogs.is_open or self.lesson.player is not None
        viewer = self.viewer
        drag_tool = viewer.toolbox.hand
        is_idle = not is_open and viewer.tool is drag_tool and viewer.selected_robot is None
        if name == "cancel" and is_idle:
            self.returns_to_editor = not drag_tool.cancel(viewer.session)
        else:
            super().do(name)


def open_play_window(
    editor: Editor, screen: pygame.Surface, scale: float, *, waits_for_workers: bool
) -> PlayWindow:
    """Open the map of an editor in the viewer.

    Parameters
    ----------
    editor : Editor
        The editor.
    screen : Surface
        Screen of the window in which the viewer is shown.
    scale : float
        Size of text and widgets.
    waits_for_workers : bool
        Whether to wait for everything instead of computing in the background.

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
        play_window = PlayWindow(viewer, drafts, screen, scale, is_unattended=waits_for_workers)
    except BaseException:
        costs.close()
        raise
    # Without this update, the first frame would have no panel.
    play_window.panel.update(FIRST_UPDATE_S)
    viewer.show_message(f"trying “{editor.sketch.name}”: F5 or Esc leads back to the editor")
    return play_window


def build_play_change(sketch: Sketch, before: Environment, after: Environment) -> Change | None:
    """Build one change of all obstacles that were drawn, moved or deleted in the viewer.

    Parameters
    ----------
    sketch : Sketch
        The map in the editor.
    before, after : Environment
        The map when play mode started, and the current one of the viewer.

    Returns
    -------
    Change or None
        None if no obstacle has changed. Unchanged obstacles keep their keys and marks.
    """
    if after is before or after.obstacles == before.obstacles or after.boundary != before.boundary:
        return None
    remaining = list(sketch.obstacles)
    items: list[Item] = []
    key = sketch.next_key
    for shape in after.obstacles:
        # Shapes in the viewer have no keys, so unchanged obstacles are found by equality.
        same = next((item for item in remaining if item.shape == shape), None)
        if same is not None:
            remaining.remove(same)
            items.append(same)
        else:
            items.append(Item(key, shape))
            key += 1
    new = frozenset(item.key for item in items if item.key not in sketch.index_by_key)
    description = "changes made while trying it"
    return Change(replace(sketch, obstacles=tuple(items)), Selection(items=new), description)
