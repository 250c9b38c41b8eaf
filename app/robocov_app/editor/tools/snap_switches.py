"""The snap modes that can be switched on and off."""

from typing import NamedTuple

from robocov_app.toolkit.tools.snapping import SnapKind


class SnapMode(NamedTuple):
    """A snap mode that can be switched on and off.

    Attributes
    ----------
    title : str
        Label of the mode.
    kinds : frozenset of str
        Kinds of snap targets that the mode includes; see `SnapSettings.kinds`.
    """

    title: str
    kinds: frozenset[SnapKind]


SNAPS: dict[str, SnapMode] = {
    "grid": SnapMode("Grid", frozenset({"grid"})),
    "vertices": SnapMode("Vertices", frozenset({"vertex", "midpoint", "center", "intersection"})),
    "edges": SnapMode("Edges", frozenset({"edge"})),
    "angles": SnapMode("Angles", frozenset({"angle"})),
    "alignment": SnapMode("Alignment", frozenset({"aligned"})),
}
"""The snap modes by name."""
