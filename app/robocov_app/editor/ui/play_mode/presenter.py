"""The viewer's presenter in play mode, which also offers the edited map by its title."""

from pathlib import Path

from robocov.controllers import list_controller_classes
from robocov_app.viewer.actions.files import FileActions
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.session import Session


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
