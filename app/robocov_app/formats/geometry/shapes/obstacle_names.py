"""Names of the obstacles that are built from shapes of a drawing."""

from collections.abc import Sequence

from robocov.errors import to_one_line
from robocov.mapfile.models import MAX_LABEL_CHARACTERS

_UNNAMED_LAYER = "0"
"""Layer of a DXF file on which everything is drawn by default."""


def get_obstacle_name(labels: Sequence[str]) -> str | None:
    """Return the name of an obstacle with these labels, or None. The default layer of DXF is not a name."""
    if not labels or labels[0] == _UNNAMED_LAYER:
        return None
    return to_one_line(labels[0])[:MAX_LABEL_CHARACTERS].strip() or None
