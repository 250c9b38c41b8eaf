"""State that all actions of the viewer share: session, view, inspection, tools and the status message."""

from collections.abc import Callable, Iterable

from robocov.controllers import CONTROLLERS
from robocov.environment import Environment, Obstacle
from robocov.errors import RobocovError
from robocov_app.toolkit.window.window_model import WindowModel
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.tool import ViewerTool
from robocov_app.viewer.tools.toolbox import ViewerToolbox
from robocov_app.viewer.view import ViewState


class ViewerModel(WindowModel):
    """State of the viewer, independent of pygame.

    Parameters
    ----------
    session : Session
        The open session.
    costs : Costs
        Computes the coverage cost of the session's panes.
    layers : set of str
        Names of the visible layers.
    controllers : iterable of str
        Names of controllers to offer in addition to the built-in ones.

    Attributes
    ----------
    view : ViewState
        Visible layers and other options of the window.
    inspection : Inspection
        Selected robot, active pane and cursor.
    toolbox : ViewerToolbox
        The tools, and the one in use.
    controllers : list of str
        Names of the controllers that are offered.
    settled_change : Node or None
        Last edit after which the team has settled; it stays set even if the team moves again a little.
    """

    def __init__(
        self, session: Session, costs: Costs, layers: set[str], controllers: Iterable[str] = ()
    ) -> None:
        """Build the state for a session, and start to prepare the cost on its map."""
        super().__init__()
        self.session = session
        self.costs = costs
        self.view = ViewState(layers)
        self.inspection = Inspection()
        self.toolbox = ViewerToolbox(self.inspection)
        self.controllers = list(dict.fromkeys([*CONTROLLERS, *controllers]))
        self.settled_change: Node | None = None
        self._cost_map: Environment | None = None
        self._cost_radius = 0.0
        self.update_cost_map()

    @property
    def tool(self) -> ViewerTool:
        """The tool in use."""
        return self.toolbox.current

    @property
    def active_pane(self) -> int:
        """Index of the pane whose controller and gains are edited."""
        return min(self.inspection.active_pane, len(self.session.timeline.panes) - 1)

    @property
    def pane(self) -> Pane:
        """The pane whose controller and gains are edited."""
        return self.session.timeline.panes[self.active_pane]

    @property
    def robot_numbers(self) -> list[int]:
        """Numbers of all robots, including those that failed."""
        return self.session.displayed.get_setup(self.pane).all_numbers

    @property
    def selected_robot(self) -> int | None:
        """Number of the selected robot, if it is still in the team."""
        selected = self.inspection.selected
        if selected in self.robot_numbers:
            return selected
        return None

    @property
    def selected_obstacles(self) -> tuple[Obstacle, ...]:
        """The selected obstacles that are still on the displayed map."""
        obstacles = self.session.displayed.environment.obstacles
        return tuple(obstacle for obstacle in self.inspection.obstacles if obstacle in obstacles)

    def attempt(self, action: Callable[[], object]) -> None:
        """Run an action, and show the message that it returns or the error that it raises."""
        super().attempt(action)
        self.update_cost_map()

    def describe_error(self, error: RobocovError) -> str:
        """Return the message of an error without prefixes that refer to files."""
        return simplify_message(str(error))

    def update_cost_map(self) -> None:
        """Start to prepare the cost on the displayed map if the map or the smallest robot has changed."""
        displayed = self.session.displayed
        environment = displayed.environment
        panes = self.session.timeline.panes
        radius = min(displayed.get_setup(pane).team.min_radius for pane in panes)
        has_changed = environment is not self._cost_map or radius != self._cost_radius
        # While the density is being painted, it changes too often to prepare the cost.
        if has_changed and not self.tool.is_painting:
            self._cost_map = environment
            self._cost_radius = radius
            self.costs.set_environment(environment, radius)

    def show_session(self, session: Session) -> None:
        """Show another session."""
        session.playback.clock.budget = self.session.playback.clock.budget
        # Objects that cache data of the past compare this version, which must not repeat an earlier value.
        session.timeline.past_version = (
            max(session.timeline.past_version, self.session.timeline.past_version) + 1
        )
        self.session = session
        self.revision += 1
        self.update_cost_map()


def simplify_message(message: str) -> str:
    """Remove prefixes from a message that only make sense for files.

    >>> simplify_message("team.max_speed: expected a number, got 0 m/s")
    'max_speed: expected a number, got 0 m/s'
    """
    return message.removeprefix("team.").removeprefix("obstacles: ")
