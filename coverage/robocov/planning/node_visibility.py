"""The nodes at which paths from a position enter the lattice, and lines of sight to them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from robocov.planning.lattice import Frame, find_clear_lines, find_nearest_nodes
from robocov.planning.map_window import MapWindow
from robocov.typing import BoolArray, FloatArray, IntArray

NO_NODE = -1
"""Index that stands for no node."""
_MAX_NEAREST_NODES = 12
"""Maximum number of nodes that `NodeVisibility.find_nearest_nodes` returns."""
_MAX_CACHED_POSITIONS = 1000
"""Maximum number of positions whose entry nodes are cached."""


@dataclass(eq=False)
class NodeVisibility:
    """Lines of sight between positions and the nodes of a map window.

    The entry nodes of positions are cached, because several robots need them several times.

    Parameters
    ----------
    map_window : MapWindow
    """

    map_window: MapWindow
    _entry_nodes: dict[bytes, IntArray] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _frame(self) -> Frame:
        """Position of the window's cells. The last row and column do not exceed those of the raster."""
        window = self.map_window.window
        raster = self.map_window.known_map.raster
        rows, columns = raster.shape
        height, width = window.shape
        low_x, low_y = raster.origin
        return Frame(
            low_x=low_x,
            low_y=low_y,
            cell_size=raster.cell_size,
            first_row=window.first_row,
            first_column=window.first_column,
            last_row=min(window.first_row + height, rows) - 1,
            last_column=min(window.first_column + width, columns) - 1,
        )

    def find_clear_lines(
        self, position: FloatArray, ends: FloatArray, is_obstructing: BoolArray, ignored_length: float = 0.0
    ) -> BoolArray:
        """Find the straight lines from a position that cross no obstructing cell.

        Parameters
        ----------
        position : (2,) array, m
        ends : (k, 2) array, m
        is_obstructing : (h, w) bool array
            For example `MapWindow.is_blocked` or `MapWindow.is_near_wall`.
        ignored_length : float, m
            Points of a line within this distance of the position are not tested. Routes start at the position
            of a robot, which may itself be too close to a wall.

        Returns
        -------
        (k,) bool array
            Whether each line is clear.
        """
        return find_clear_lines(position, ends, is_obstructing, self._frame, ignored_length)

    def find_nearest_nodes(self, position: FloatArray, is_candidate: BoolArray) -> IntArray:
        """Find the candidates that are nearest to a position, whether they are visible or not.

        Parameters
        ----------
        position : (2,) array, m
        is_candidate : (m,) bool array
            Whether each node is a candidate.

        Returns
        -------
        (k,) int array
            At most `_MAX_NEAREST_NODES`, nearest first.
        """
        return find_nearest_nodes(position, self.map_window.nodes, is_candidate, _MAX_NEAREST_NODES)

    def find_nearest_node(self, position: FloatArray) -> int:
        """Find the nearest node with clearance, whether it is visible or not.

        Parameters
        ----------
        position : (2,) array, m

        Returns
        -------
        int
            `NO_NODE` if no node has clearance.
        """
        nearest_nodes = self.find_nearest_nodes(position, self.map_window.has_clearance)
        return int(nearest_nodes[0]) if len(nearest_nodes) else NO_NODE

    def find_entry_node(self, position: FloatArray) -> int:
        """Find the nearest node at which a path from a position can enter the lattice.

        Parameters
        ----------
        position : (2,) array, m

        Returns
        -------
        int
            The first of `get_entry_nodes`. `NO_NODE` if no node has clearance.
        """
        entry_nodes = self.get_entry_nodes(position)
        return int(entry_nodes[0]) if len(entry_nodes) else NO_NODE

    def get_entry_nodes(self, position: FloatArray) -> IntArray:
        """Return the nodes at which a path from a position can enter the lattice.

        These are the visible ones among the nearest nodes with clearance, or only the nearest one if none of
        them is visible.

        Parameters
        ----------
        position : (2,) array, m

        Returns
        -------
        (k,) int array
            The nearest one first. Empty if no node has clearance.
        """
        key = position.tobytes()
        if key not in self._entry_nodes:
            if len(self._entry_nodes) >= _MAX_CACHED_POSITIONS:
                self._entry_nodes.clear()
            nearest_nodes = self.find_nearest_nodes(position, self.map_window.has_clearance)
            ends = self.map_window.nodes[nearest_nodes]
            is_visible = self.find_clear_lines(position, ends, self.map_window.is_blocked)
            # The cell of a robot next to a wall may be marked as part of the wall, so that the robot sees no
            # node. It then enters at the nearest one.
            self._entry_nodes[key] = nearest_nodes[is_visible] if is_visible.any() else nearest_nodes[:1]
        return self._entry_nodes[key]
