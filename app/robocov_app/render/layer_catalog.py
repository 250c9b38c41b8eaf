"""All layers that a picture can have, in the order in which they are drawn."""

from collections.abc import Iterable
from dataclasses import replace

from robocov.errors import ParameterError, describe_unknown_name
from robocov_app.look.hues import ColorScheme
from robocov_app.render.annotations import captions, scale_bar
from robocov_app.render.annotations.color_bar import draw_color_bar
from robocov_app.render.annotations.legend_strip import LegendLayer
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers import (
    arrows,
    cells,
    cursor_path,
    density,
    distances,
    known_obstacles,
    marks,
    perception,
    ray_scans,
    robots,
    static_map,
)
from robocov_app.render.layers.layer import Layer
from robocov_app.render.layers.trajectories import TrajectoriesLayer
from robocov_app.render.scene import Scene

FIELD_LAYERS = frozenset({"distances", "geodesic_cells"})
"""Layers that need the distances to the nearest robot."""


def build_standard_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Build all layers of a picture, from the lowest to the topmost.

    Parameters
    ----------
    trails : {"robots", "paper"}
        Colors of the trajectories.

    Returns
    -------
    list of Layer
    """
    return [
        *_build_map_layers(),
        *_build_perception_layers(),
        *_build_mark_layers(trails),
        *_build_arrow_layers(),
        *_build_robot_layers(),
        *_build_strips(),
    ]


def build_pane_layers(trails: ColorScheme = "robots") -> list[Layer]:
    """Build the layers of one pane among several, which has a caption but no separate legend."""

    def draw_status(canvas: Canvas, scene: Scene) -> None:
        # Controller and cost are already in the caption.
        captions.draw_status(canvas, replace(scene, label="", cost=""))

    shared = [layer for layer in build_standard_layers(trails) if layer.name not in ("legend", "status")]
    caption = Layer("caption", "Caption", captions.draw_caption, is_in_world=False)
    status = Layer("status", "Status line", draw_status, is_in_world=False)
    return [*shared, caption, status]


def check_layer_names(option: str, names: Iterable[str]) -> frozenset[str]:
    """Check layer names that the user typed, with underscores or dashes.

    Parameters
    ----------
    option : str
        Name of the option in messages.
    names : iterable of str

    Returns
    -------
    frozenset of str
        The names with underscores.

    Raises
    ------
    ParameterError
        If a layer is unknown.
    """
    known_names = [layer.name for layer in build_standard_layers()]
    layer_names = [name.replace("-", "_") for name in names]
    for name in layer_names:
        if name not in known_names:
            raise ParameterError(f"{option}: {describe_unknown_name('layer', name, known_names)}")
    return frozenset(layer_names)


def _build_map_layers() -> list[Layer]:
    """Build the layers of areas: heat maps, cells and the map itself."""
    return [
        Layer(
            "distances",
            "Distance map",
            distances.FieldLayer(distances.render_distances).draw,
            needs=("field",),
            legend=distances.build_distances_legend,
            is_default=False,
        ),
        Layer(
            "geodesic_cells",
            "Geodesic cells",
            distances.FieldLayer(distances.render_geodesic_cells).draw,
            needs=("field",),
            legend=distances.build_geodesic_cells_legend,
            is_default=False,
        ),
        Layer(
            "cells",
            "Voronoi cells",
            cells.draw_cells,
            needs=("cells",),
            legend=cells.build_cells_legend,
        ),
        Layer("grid", "Grid", static_map.draw_grid, is_static=True),
        Layer(
            "density",
            "Density φ",
            density.draw_density,
            legend=density.build_density_legend,
            is_static=True,
        ),
        Layer(
            "obstacles",
            "Obstacles",
            static_map.draw_obstacles,
            legend=static_map.build_obstacles_legend,
            is_static=True,
        ),
        Layer("boundary", "Boundary", static_map.draw_boundary, is_static=True),
    ]


def _build_perception_layers() -> list[Layer]:
    """Build the layers of what robots perceive: known obstacles, scans, ranges and neighbors."""
    return [
        Layer(
            "sensed",
            "Known obstacles",
            known_obstacles.KnownObstaclesLayer().draw,
            needs=("sensed", "snapshot"),
            legend=known_obstacles.build_known_obstacles_legend,
            is_default=False,
        ),
        Layer(
            "scan",
            "Ray scans",
            ray_scans.draw_scans,
            needs=("scans",),
            legend=ray_scans.build_scans_legend,
            is_default=False,
        ),
        perception.build_range_layer("sensing", "Sensing"),
        perception.build_range_layer("communication", "Communication"),
        Layer(
            "links",
            "Neighbors",
            perception.draw_links,
            needs=("snapshot",),
            legend=perception.build_links_legend,
            is_default=False,
        ),
    ]


def _build_mark_layers(trails: ColorScheme) -> list[Layer]:
    """Build the layers of trajectories, starts, obstacle points, goals and centroids."""
    trajectories = TrajectoriesLayer(trails)
    return [
        Layer(
            "trajectories",
            "Trajectories",
            trajectories.draw,
            needs=("trail",),
            legend=trajectories.build_legend,
        ),
        Layer(
            "starts",
            "Starts",
            marks.StartsLayer().draw,
            needs=("starts",),
            legend=marks.build_starts_legend,
        ),
        Layer(
            "obstacle_points",
            "Nearest obstacles",
            perception.draw_obstacle_points,
            needs=("snapshot",),
            legend=perception.build_obstacle_points_legend,
            is_default=False,
        ),
        Layer(
            "goals",
            "Goals",
            marks.draw_goals,
            needs=("snapshot",),
            legend=marks.build_goals_legend,
            is_default=False,
            needs_goals=True,
        ),
        Layer(
            "centroids",
            "Centroids",
            marks.draw_centroids,
            needs=("snapshot",),
            legend=marks.build_centroids_legend,
            needs_goals=True,
        ),
    ]


def _build_arrow_layers() -> list[Layer]:
    """Build the layers of velocities and force terms."""
    return [
        arrows.build_velocity_layer(),
        arrows.build_force_layer("attraction", "Attraction", "full"),
        arrows.build_force_layer("repulsion_robots", "Robot repulsion", "open"),
        arrows.build_force_layer("repulsion_obstacle", "Obstacle repulsion", "dot"),
        arrows.build_force_layer("viscosity", "Viscosity", "bar"),
        arrows.build_force_layer("resultant", "Resultant force", "full"),
    ]


def _build_robot_layers() -> list[Layer]:
    """Build the layers of robots, of their contacts, and of the path from the cursor."""
    return [
        Layer(
            "path",
            "Path from cursor",
            cursor_path.draw_cursor_path,
            needs=("path",),
            legend=cursor_path.build_cursor_path_legend,
            is_default=False,
        ),
        Layer(
            "failed",
            "Failed robots",
            robots.draw_failed_robots,
            needs=("failed",),
            legend=robots.build_failed_robots_legend,
        ),
        Layer(
            "selection",
            "Selection",
            robots.draw_selection,
            needs=("snapshot", "selected"),
            legend=robots.build_selection_legend,
        ),
        Layer(
            "robots",
            "Robots",
            robots.draw_robots,
            needs=("snapshot",),
            legend=robots.build_robots_legend,
        ),
        Layer(
            "contacts",
            "Contacts",
            marks.draw_contacts,
            needs=("snapshot", "contacts"),
            legend=marks.build_contacts_legend,
        ),
    ]


def _build_strips() -> list[Layer]:
    """Build the layers of annotations around the arena."""
    return [
        Layer("color_bar", "Color scale", draw_color_bar, needs=("field",), is_in_world=False),
        Layer("legend", "Legend", LegendLayer().draw, is_in_world=False),
        Layer("scale_bar", "Scale bar", scale_bar.draw_scale_bar, is_in_world=False),
        Layer("status", "Status line", captions.draw_status, is_in_world=False),
    ]
