"""Actions on controllers: choosing one, comparing several side by side, setting gains and limits."""

from robocov.controllers.gains import Value
from robocov_app.viewer.actions.playback import find_next
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.panel.parameters import (
    Parameter,
    list_gain_parameters,
    list_limit_parameters,
    replace_limit,
)
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.timeline import Timeline

_KINDS_NOT_REPEATED = frozenset({"hand", "robot", "failure"})
"""Kinds of events that are lost when a run restarts; edited maps, controllers and limits are kept."""
_MAX_LISTED_EVENTS = 3
_PAIR = 2


class ComparisonActions:
    """Actions that choose controllers and set their gains, in one pane or in several.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self._viewer = viewer

    def list_candidates(self) -> list[str]:
        """Return the names of the controllers to compare with: first those that are not shown yet."""
        viewer = self._viewer
        shown = {pane.controller.name for pane in viewer.session.timeline.panes}
        return sorted(viewer.controllers, key=lambda name: name in shown)

    def add_pane(self, name: str) -> None:
        """Restart with one more pane, in which a controller is shown next to the others.

        Raises
        ------
        ParameterError
            If no more panes can be added.
        """
        viewer = self._viewer
        session = viewer.session
        dropped = _list_dropped_events(session.timeline)
        session.add_pane(ControllerChoice(name))
        viewer.inspection.active_pane = len(session.timeline.panes) - 1
        pane_count = len(session.timeline.panes)
        controllers = f"all {pane_count} controllers" if pane_count > _PAIR else "both controllers"
        message = f"{controllers} start again at 0 s"
        if dropped:
            message += f", without {_list_edits(dropped)}"
        # The list of controllers has already said that undo returns to the run before.
        viewer.show_message(f"{message}.")

    def remove_pane(self) -> None:
        """Remove the active pane."""
        self._viewer.session.remove_pane(self._viewer.pane)

    def activate_next_pane(self) -> None:
        """Make the next pane the active one, whose controller and gains are edited."""
        viewer = self._viewer
        viewer.inspection.active_pane = (viewer.active_pane + 1) % len(viewer.session.timeline.panes)

    def choose_next_controller(self) -> None:
        """Use the next controller in the active pane."""
        viewer = self._viewer
        name = find_next(viewer.controllers, viewer.session.displayed.get_setup(viewer.pane).controller.name)
        viewer.session.set_controller(viewer.pane, ControllerChoice(name))

    def set_controller(self, number: int, name: str) -> None:
        """Use a controller in a pane, given by its index; if it is already used there, its gains are kept."""
        session = self._viewer.session
        pane = session.timeline.panes[number]
        if session.displayed.get_setup(pane).controller.name != name:
            session.set_controller(pane, ControllerChoice(name))
        self._viewer.inspection.active_pane = number

    def use_controller(self, name: str) -> None:
        """Use a controller in the active pane, even one that is not in the list yet.

        Raises
        ------
        ParameterError
            If there is no such controller.
        """
        viewer = self._viewer
        ControllerChoice(name).build()
        if name not in viewer.controllers:
            viewer.controllers.append(name)
        self.set_controller(viewer.active_pane, name)

    def list_parameters(self) -> list[Parameter]:
        """Return the gains of the active pane's controller and the limits of the team."""
        setup = self._viewer.session.displayed.get_setup(self._viewer.pane)
        return [*list_gain_parameters(setup.controller), *list_limit_parameters(setup.properties)]

    def set_parameter(self, name: str, value: Value) -> None:
        """Set a gain of the active pane's controller, or with the prefix ``team.`` a limit of the team."""
        viewer = self._viewer
        setup = viewer.session.displayed.get_setup(viewer.pane)
        if name.startswith("team."):
            viewer.session.set_properties(replace_limit(setup.properties, name, value))
        else:
            viewer.session.set_controller(viewer.pane, setup.controller.with_gain(name, value))


def _list_dropped_events(timeline: Timeline) -> list[str]:
    """Return the texts of the events that a restart does not repeat."""
    # Failures and joins that the conditions cause happen again; drags of a replayed record do not.
    repeated = set()
    for node in timeline.document.get_path(timeline.head):
        repeated |= {(event.kind, event.text) for event in node.automatic_events if event.kind != "hand"}
    return [
        event.text
        for event in timeline.events
        if event.kind in _KINDS_NOT_REPEATED and (event.kind, event.text) not in repeated
    ]


def _list_edits(edits: list[str]) -> str:
    """Return the text of one or more edits, of which only the first are listed.

    Examples
    --------
    >>> _list_edits(["robot 5 failed"])
    'this edit: robot 5 failed'
    """
    listed = ", ".join(edits[:_MAX_LISTED_EVENTS])
    if len(edits) > _MAX_LISTED_EVENTS:
        listed += f" and {len(edits) - _MAX_LISTED_EVENTS} more"
    demonstrative = "this edit" if len(edits) == 1 else "these edits"
    return f"{demonstrative}: {listed}"
