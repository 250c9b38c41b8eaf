"""The demo on the map that is being drawn, in the same window; and back."""

from dataclasses import replace
from pathlib import Path

import pygame

from robocov.controllers import list_controller_classes
from robocov.defaults import DEFAULT_LATTICE
from robocov.environment import Environment
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.ui.editor import Editor
from robocov_app.render.picture import standard_layers
from robocov_app.toolkit.input import key_of
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.scenario import Scenario, TeamSpec
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window import Window


class PlayPresenter(Presenter):
    """The viewer's presenter, which knows whether the map is still the one that is tried."""

    elsewhere = False  # whether another map was opened meanwhile

    def __init__(self, session: Session, costs: Costs, shown: set[str], folder: Path, title: str) -> None:
        self.tried, self._title = session.environment, title
        super().__init__(session, costs, shown, folder, title, list_controller_classes())

    def open_map(self, name: str) -> None:
        if name == self._title:
            self.session.restart(environment=self.tried)
            self.map_name = name
        else:
            super().open_map(name)
        self.elsewhere = name != self._title

    def maps(self) -> list[str]:
        return list(dict.fromkeys([self._title, *super().maps()]))


class PlayWindow(Window):
    """The viewer's window, out of which F5 and Escape lead back."""

    viewer: PlayPresenter
    hint = "F5 back to the editor · F1 keys"

    def __init__(self, viewer: PlayPresenter, screen: pygame.Surface, scale: float, *, patient: bool) -> None:
        self.ended = False  # back to the editor
        self.held: int | None = None  # the key that began it, until it comes up: it may repeat
        super().__init__(viewer, screen.get_size(), scale, patient=patient, screen=screen)

    def take(self, event: pygame.event.Event) -> None:
        if event.type == pygame.WINDOWFOCUSLOST or (event.type == pygame.KEYUP and event.key == self.held):
            self.held = None
        if event.type == pygame.KEYDOWN and event.key == self.held:
            return
        if event.type == pygame.KEYDOWN and key_of(event) == "f5":
            self.ended = True
        else:
            super().take(event)

    def do(self, name: str) -> None:
        """Do the action of this name; Escape leads back where it would do nothing."""
        idle = not (self.help or self.dialogs.open or self.tour is not None)
        viewer = self.viewer
        if name == "cancel" and idle and viewer.tool is viewer.hand and viewer.selected is None:
            self.ended = not viewer.hand.cancel(viewer.session)
        else:
            super().do(name)


def begun(editor: Editor, screen: pygame.Surface, scale: float, *, patient: bool) -> PlayWindow:
    environment = editor.sketch.environment()
    name = editor.start_name if editor.start_name in environment.starts else None
    spec = TeamSpec(radius=editor.radius)
    session = Session(Scenario(environment, robots=editor.robots, start=name, seed=editor.seed, limits=spec))
    if patient:
        session.clock.budget = float("inf")
    costs = Costs(DEFAULT_LATTICE, direct=patient)
    try:
        shown = {layer.name for layer in standard_layers() if layer.default}
        demo = PlayPresenter(session, costs, shown, editor.folder, editor.document.title)
        demo.theme = editor.theme
        trial = PlayWindow(demo, screen, scale, patient=patient)
    except BaseException:
        costs.close()
        raise
    trial.panel.update(0.01)  # or its first frame would be without it
    demo.say(f"trying “{editor.sketch.name}”: F5 or Esc leads back to the editor")
    return trial


def brought_back(sketch: Sketch, before: Environment, after: Environment) -> Change | None:
    """Return what was drawn, moved and deleted while it was tried, as one change; None if nothing was."""
    if after is before or after.obstacles == before.obstacles or after.boundary != before.boundary:
        return None
    left = list(sketch.obstacles)
    items: list[Item] = []
    key = sketch.fresh_key
    for shape in after.obstacles:
        # who is as it was keeps its key and its notes
        same = next((item for item in left if item.shape == shape), None)
        if same is not None:
            left.remove(same)
        else:
            same, key = Item(key, shape), key + 1
        items.append(same)
    new = frozenset(item.key for item in items if item.key not in sketch.places)
    words = "what was changed while trying it, taken over"
    return Change(replace(sketch, obstacles=tuple(items)), Selection(items=new), words)
