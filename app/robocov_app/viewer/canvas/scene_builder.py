"""Builds the scenes of the panes from the displayed step of a session."""

from dataclasses import replace

import numpy as np

from robocov.typing import FloatArray
from robocov_app.render.density_text import format_cost, get_cost_name
from robocov_app.render.distance_map.colors import choose_color_limit
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Contacts, Scene
from robocov_app.viewer.canvas.contacts import ContactFinder
from robocov_app.viewer.costs.costs import KnownCost
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.past.decision_replay import get_sensor
from robocov_app.viewer.session.past.states import PaneSetup
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.view import FADE_S
from robocov_app.viewer.window.status import describe_cut_off

MAX_RAYS_PER_SCAN = 120
MAX_RAYS_PER_PANE = 720
MIN_RAYS_PER_SCAN = 24  # with fewer, scans are not drawn
UNLIMITED_SCAN_RANGE_M = 12.0  # length of rays if the sensing range is unlimited
MAX_COST_LAG_S = 0.25  # if the displayed cost is older than this, its caption states its time

_COLOR_LIMIT_MARGIN = 1.1  # so that the color scale does not have to change again soon
_COLOR_LIMIT_RANGE = (0.55, 1.0)
"""The color scale stays while the largest distance, as a fraction of its end, is between these."""


class SceneBuilder:
    """Builds the scene of a pane: robots, trajectories, costs and scans.

    All panes share the color scale of distances.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    """

    def __init__(self, viewer: Presenter) -> None:
        self._viewer = viewer
        self._color_limit = 1.0  # end of the color scale of distances, m
        self._contact_finder = ContactFinder()
        self._session_with_contacts: Session | None = None

    def build(self, pane: Pane, painter: Painter) -> Scene:
        """Build the scene of a pane at the displayed step, with those costs and scans that are visible."""
        viewer = self._viewer
        displayed = viewer.session.displayed
        setup = displayed.get_setup(pane)
        snapshot = displayed.get_snapshot(pane)
        known_cost = viewer.costs.known.get(pane.number)
        selected = viewer.selected_robot
        row = setup.numbers.index(selected) if selected in setup.numbers else None
        if known_cost is not None and painter.needs_field:
            self._update_color_limit(known_cost.field.max_distance)
        scene = pane.build_scene(
            setup,
            snapshot,
            displayed.get_trail(pane),
            trail_fade=FADE_S if viewer.view.fades_trajectories else None,
            field=known_cost.field if known_cost is not None and painter.needs_field else None,
            field_limit=self._color_limit,
            cost=self._describe_cost(pane),
            selected=row,
            scans=self._list_scans(pane, setup, snapshot.positions, row),
            sensed=pane.sensed,
            path=self._get_path(known_cost),
        )
        return replace(scene, contacts=self._find_contacts(setup, scene))

    def _find_contacts(self, setup: PaneSetup, scene: Scene) -> Contacts | None:
        """Return the contacts of a scene; None until a contact has been displayed in the session.

        From then on, the layer bar has a chip for contacts. If it disappeared after each contact, the other
        chips would move back and forth.
        """
        session = self._viewer.session
        contacts = self._contact_finder.find_contacts(setup.environment, scene)
        if len(contacts):
            self._session_with_contacts = session
        return contacts if self._session_with_contacts is session else None

    def _update_color_limit(self, largest: float) -> None:
        """Adapt the color scale to the largest distance, m, but only when it has changed considerably."""
        low, high = _COLOR_LIMIT_RANGE
        if np.isfinite(largest) and not low * self._color_limit <= largest <= high * self._color_limit:
            self._color_limit = choose_color_limit(_COLOR_LIMIT_MARGIN * largest)

    def _get_path(self, known_cost: KnownCost | None) -> FloatArray | None:
        """Return the path from the cursor to its nearest robot, (k, 2) m; None if it is not shown."""
        if known_cost is None or self._viewer.inspection.cursor is None:
            return None
        return known_cost.path

    def _list_scans(
        self, pane: Pane, setup: PaneSetup, positions: FloatArray, selected: int | None
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return the scan of the selected robot or, if none is selected, the scans of all robots.

        Nothing is returned for teams so large that each scan would have too few rays.

        Returns
        -------
        list of tuple of array
            For each scan, the position of the robot, (2,) m, and the end points of its rays, (k, 2) m.
        """
        if "scan" not in self._viewer.view.layers:
            return []
        rows = range(len(setup.numbers)) if selected is None else range(selected, selected + 1)
        rays = min(MAX_RAYS_PER_SCAN, MAX_RAYS_PER_PANE // len(rows))
        if rays < MIN_RAYS_PER_SCAN:
            return []
        ranges = setup.team.sensing_range
        reach = np.where(np.isfinite(ranges), ranges, UNLIMITED_SCAN_RANGE_M).tolist()
        session = self._viewer.session
        if session.timeline.is_live:
            sensor = pane.simulation.sensor
        else:
            # The sensor of the simulation senses the obstacles of the present.
            sensor = get_sensor(setup.sensed_environment, session.displayed.time)
        return [(positions[row], sensor.scan_from(positions[row], rays, reach[row])[1]) for row in rows]

    def _describe_cost(self, pane: Pane) -> str:
        """Return the caption with a pane's cost. All panes show their cost at the same time."""
        displayed = self._viewer.session.displayed
        time, distances = displayed.get_costs()
        _, travel_times = displayed.get_costs("time")
        if pane.number not in distances:
            return ""
        name = get_cost_name(displayed.get_setup(pane).environment)
        text = format_cost(name, distances[pane.number], travel_times.get(pane.number))
        cut_off = describe_cut_off(self._viewer, pane)
        if cut_off:
            text += f" ({cut_off})"
        if displayed.time - time > MAX_COST_LAG_S:
            return f"{text} at {time:.1f} s"
        return text
