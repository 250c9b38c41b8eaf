"""Groups of layers in the menu of the window, and presets: sets of layers for a purpose."""

from dataclasses import dataclass

LAYER_GROUPS: dict[str, tuple[str, ...]] = {
    "Coverage": ("cells", "centroids", "distances", "geodesic_cells", "density", "color_bar"),
    "Motion": ("robots", "failed", "contacts", "trajectories", "starts", "velocities", "goals", "path"),
    "Forces": (
        "force_attraction",
        "force_repulsion_robots",
        "force_repulsion_obstacle",
        "force_viscosity",
        "force_resultant",
    ),
    "Knowledge": ("sensed", "scan", "sensing", "communication", "links", "obstacle_points"),
    "Map and page": ("obstacles", "boundary", "grid", "selection", "legend", "scale_bar", "status"),
}
"""Names of the layers in each group, in the order of the menu."""

_BASE_LAYERS = frozenset(
    {
        "obstacles",
        "boundary",
        "robots",
        "failed",
        "selection",
        "color_bar",
        "legend",
        "scale_bar",
        "status",
    }
)
"""Layers that all presets show."""


@dataclass(frozen=True)
class LayerPreset:
    """A set of layers for a purpose.

    Attributes
    ----------
    name : str
        Identifier, as in the command ``preset:simple``.
    title : str
        Name in the window.
    description : str
        Its content, as a noun phrase.
    layers : frozenset of str
        Names of its layers.
    """

    name: str
    title: str
    description: str
    layers: frozenset[str]


LAYER_PRESETS = (
    LayerPreset(
        "simple",
        "Simple",
        "Robots, their trajectories and their cells",
        _BASE_LAYERS | {"cells", "contacts", "density", "trajectories"},
    ),
    LayerPreset(
        "why",
        "Why?",
        "The goal of each robot, and the forces that move it",
        _BASE_LAYERS
        | {"cells", "contacts", "density", "goals", "velocities", "obstacle_points"}
        | {"force_attraction", "force_repulsion_robots", "force_repulsion_obstacle"},
    ),
    LayerPreset(
        "knowledge",
        "What robots know",
        "The obstacles that the team has sensed, and the range and the neighbors of each robot",
        _BASE_LAYERS | {"sensed", "sensing", "communication", "links", "trajectories"},
    ),
    LayerPreset(
        "print",
        "Print",
        "The layers of a figure for an article, without a grid",
        _BASE_LAYERS | {"cells", "density", "trajectories", "starts"},
    ),
)


def find_preset(layers: set[str]) -> LayerPreset | None:
    """Return the preset with exactly these layers; None if there is none."""
    for preset in LAYER_PRESETS:
        if preset.layers == layers:
            return preset
    return None
