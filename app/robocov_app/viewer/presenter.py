"""The viewer's presenter: state of the window, and all actions on it, grouped by subject."""

from collections.abc import Iterable
from pathlib import Path

from robocov_app.viewer.actions.comparison import ComparisonActions
from robocov_app.viewer.actions.files import FileActions
from robocov_app.viewer.actions.playback import PlaybackActions
from robocov_app.viewer.actions.robots import RobotActions
from robocov_app.viewer.actions.selection import SelectionActions
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.session import Session


class Presenter(ViewerModel):
    """State and actions of the viewer, independent of pygame.

    Parameters
    ----------
    session : Session
        The session that is shown first.
    costs : Costs
        Computes the coverage cost of the session's panes.
    layers : set of str
        Names of the visible layers.
    folder : Path
        Folder in which files are saved.
    map_name : str
        Bundled name or path of the map.
    controllers : iterable of str
        Names of controllers to offer in addition to the built-in ones.
    draft_folder : Path or None
        Folder for drafts of unsaved work; None to keep no drafts.
    file : Path or None
        File of the session.

    Attributes
    ----------
    playback : PlaybackActions
        Actions on time: playing, speed, restarting, looking back, branches, undo.
    comparison : ComparisonActions
        Actions on controllers, gains and limits.
    robots : RobotActions
        Actions on single robots.
    selection : SelectionActions
        Actions on the selected robot or obstacle.
    files : FileActions
        Actions on maps, sessions and drafts.
    """

    def __init__(
        self,
        session: Session,
        costs: Costs,
        layers: set[str],
        folder: Path,
        map_name: str = "",
        *,
        controllers: Iterable[str] = (),
        draft_folder: Path | None = None,
        file: Path | None = None,
    ) -> None:
        """Build the state, and the actions that share it."""
        super().__init__(session, costs, layers, controllers)
        self.playback = PlaybackActions(self)
        self.comparison = ComparisonActions(self)
        self.robots = RobotActions(self)
        self.selection = SelectionActions(self, self.robots)
        self.files = FileActions(self, folder, map_name=map_name, draft_folder=draft_folder, file=file)

    def choose_tool(self, name: str) -> None:
        """Switch to another tool, and show a hint on how to use it."""
        self.tool.cancel(self.session)
        self.toolbox.current = self.toolbox.by_name[name]
        hint = self.tool.hint
        if self.view.is_compact and self.tool.touch_hint:
            hint = self.tool.touch_hint
        self.show_message(f"{self.tool.title}: {hint}")

    def finish_drawing(self) -> str | None:
        """Complete the tool's drawing; return a message, or None if there was no drawing."""
        return self.tool.finish(self.session)

    def cancel(self) -> None:
        """Discard the tool's drawing; if there is nothing to discard, switch to the hand."""
        if not self.tool.cancel(self.session) and self.tool is not self.toolbox.hand:
            self.toolbox.current = self.toolbox.hand

    def resize_tool(self, factor: float) -> None:
        """Change the size of the tool in use by a factor; if it has none, the width of walls.

        With the hand, this is the width of the selected wall or, if no wall is selected, that of new walls.
        """
        if self.tool is self.toolbox.hand and self.selection.has_wall:
            self.show_message(self.selection.scale_wall_width(factor))
            return
        self.show_message(self.toolbox.resizable_tool.resize(self.session, factor))
