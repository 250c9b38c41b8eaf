"""Arrows of velocities and forces, ranges, links and sensed obstacle points."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import (
    ONE,
    TWO,
    find_layer,
    list_legend_texts,
    list_pixels,
    measure_min_error,
    render_layers,
)
from drawn_run import build_scene
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from rendered_text import check_legend_symbol, render_legend_symbols

from robocov.team import Team
from robocov_app.look.theme import DARK, LIGHT

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
MAX_ARROW_LENGTH_PX = 75


def build_moving_scene(*velocity, viscosity=1.0, positions=ONE):
    """Return a scene of robots with a common velocity in m/s and a viscosity in N s/m."""
    velocities = np.tile(np.array(velocity, dtype=float), (len(positions), 1))
    scene = build_scene(positions, velocities=velocities)
    return replace(scene, team=Team.homogeneous(len(positions), viscosity=viscosity))


def check_direction(pixels, painter, direction):
    """Check that an arrow from the robot at `ONE` points in a direction, and no pixel is behind it."""
    offsets = painter.camera.to_world(pixels.astype(float)) - ONE[0]
    mean_offset = offsets.mean(axis=0)
    assert mean_offset @ direction > 0.98 * np.linalg.norm(mean_offset)
    assert (offsets @ direction).min() > 0


def measure_arrow_length(scene, layer, direction):
    """Return how far a layer is drawn to the right (1) or to the left (-1) of the robot at `ONE`, px."""
    pixels, painter = list_pixels(scene, layer)
    if len(pixels) == 0:
        return 0.0
    x, _ = painter.camera.to_pixels(ONE[0])
    return (direction * (pixels[:, 0] - x)).max()


@settings(deadline=None, max_examples=count_examples(25))
@given(st.floats(0, 2 * np.pi), st.sampled_from(["velocities", "force_attraction", "force_resultant"]))
def test_arrows_have_the_direction_of_their_vectors(angle, layer):
    direction = np.array([np.cos(angle), np.sin(angle)])
    scene = build_scene(ONE, forces=1.5 * direction[None], velocities=0.9 * direction[None])
    pixels, painter = list_pixels(scene, layer)
    check_direction(pixels, painter, direction)


@pytest.mark.parametrize("term", ["attraction", "repulsion_robots", "repulsion_obstacle", "resultant"])
def test_stronger_forces_have_longer_arrows_up_to_a_maximum(term):
    lengths = []
    for force in (0.0, 0.5, 2.0, 1e3, 1e9):
        scene = build_scene(ONE, forces=np.array([[force, 0.0]]))
        lengths.append(measure_arrow_length(scene, f"force_{term}", direction=1))
    assert lengths[0] == 0.0
    assert lengths[0] < lengths[1] < lengths[2] < lengths[3]
    assert lengths[3] == pytest.approx(lengths[4], abs=1.01)
    assert lengths[4] < MAX_ARROW_LENGTH_PX


def test_arrows_of_terms_differ_in_shape():
    shapes = set()
    for term in ("attraction", "repulsion_robots", "repulsion_obstacle"):
        pixels, _ = list_pixels(build_scene(ONE, forces=np.array([[1.0, 0.0]])), f"force_{term}")
        shapes.add(pixels.tobytes())
    pixels, _ = list_pixels(build_scene(ONE, velocities=np.array([[-1.0, 0.0]])), "force_viscosity")
    shapes.add(pixels.tobytes())
    assert len(shapes) == 4


class TestViscosity:
    @settings(deadline=None, max_examples=count_examples(25))
    @given(st.floats(0, 2 * np.pi))
    def test_viscosity_points_against_the_velocity(self, angle):
        direction = np.array([np.cos(angle), np.sin(angle)])
        pixels, painter = list_pixels(build_moving_scene(*0.8 * direction), "force_viscosity")
        check_direction(pixels, painter, -direction)

    def test_viscosity_ends_in_a_bar_instead_of_an_arrow_head(self):
        pixels, painter = list_pixels(build_moving_scene(-0.8, 0.0), "force_viscosity")
        x = pixels[:, 0]
        heights = [np.ptp(pixels[x == column, 1]) for column in range(x.min(), x.max())]
        assert max(heights[:-6]) <= 4 * painter.scale
        assert max(heights[-6:]) >= 6 * painter.scale
        _, y = painter.camera.to_pixels(ONE[0])
        assert abs(pixels[:, 1].mean() - y) < 1

    def test_viscosity_grows_with_speed_and_viscosity_up_to_a_maximum(self):
        lengths = []
        for speed, viscosity in ((0.3, 1.0), (0.9, 1.0), (0.9, 3.0), (0.9, 1e5)):
            scene = build_moving_scene(speed, 0.0, viscosity=viscosity)
            lengths.append(measure_arrow_length(scene, "force_viscosity", direction=-1))
        assert 10 < lengths[0] < lengths[1] < lengths[2] < lengths[3] < MAX_ARROW_LENGTH_PX

    @pytest.mark.parametrize(
        ("speed", "viscosity"), [(0.0, 1.0), (0.9, 0.0)], ids=["at rest", "frictionless"]
    )
    def test_without_speed_or_viscosity_nothing_is_drawn(self, speed, viscosity):
        pixels, _ = list_pixels(build_moving_scene(speed, 0.0, viscosity=viscosity), "force_viscosity")
        assert len(pixels) == 0

    @THEMES
    def test_viscosity_has_its_own_color(self, theme):
        frame, painter = render_layers(build_moving_scene(-0.9, 0.0), "force_viscosity", theme=theme)
        x, y = painter.camera.to_pixels(ONE[0])
        pixel_on_line = (x + 14.0 * painter.scale, y)
        assert measure_min_error(frame, pixel_on_line, theme.forces["viscosity"]) < 25

    @THEMES
    def test_the_legend_contains_viscosity(self, theme):
        scene = build_moving_scene(-0.9, 0.0)
        _, painter = render_layers(scene, "force_viscosity", theme=theme)
        assert list_legend_texts(painter, scene) == ["viscosity"]
        (image,) = render_legend_symbols(find_layer("force_viscosity"), scene, theme)
        check_legend_symbol(image, theme, theme.forces["viscosity"])

    def test_viscosity_of_robots_outside_the_view_is_not_drawn(self):
        positions = np.array([[500.0, 4.0], [4.0, -900.0]])
        pixels, _ = list_pixels(build_moving_scene(0.9, 0.0, positions=positions), "force_viscosity")
        assert len(pixels) == 0


@pytest.mark.parametrize("layer", ["sensing", "communication"])
def test_ranges_are_circles_of_their_radius(layer):
    scene = build_scene(ONE, sensing_range=2.5, communication_range=2.5)
    pixels, painter = list_pixels(scene, layer)
    offsets = pixels - painter.camera.to_pixels(ONE[0])
    radii = np.linalg.norm(offsets, axis=1)
    angles = np.arctan2(*offsets.T)
    assert np.abs(radii - 2.5 * painter.camera.zoom).max() < 2.5
    assert len(np.unique(np.round(angles, 1))) > 50


def test_an_unlimited_communication_range_is_not_drawn():
    scene = build_scene(ONE, communication_range=np.inf)
    pixels, painter = list_pixels(scene, "communication")
    assert len(pixels) == 0
    assert list_legend_texts(painter, scene) == []


ROBOTS_IN_A_ROW = np.array([[1.0, 4.0], [3.0, 4.0], [7.0, 4.0]])


def test_only_robots_within_range_are_linked():
    frame, painter = render_layers(build_scene(ROBOTS_IN_A_ROW, communication_range=2.5), "links")
    near_pair, far_pair = painter.camera.to_pixels(np.array([[2.0, 4.0], [5.0, 4.0]]))
    assert measure_min_error(frame, near_pair, LIGHT.final) < 120
    assert measure_min_error(frame, far_pair, LIGHT.background) == 0


def test_with_unlimited_range_robots_with_adjacent_cells_are_linked():
    frame, painter = render_layers(build_scene(ROBOTS_IN_A_ROW), "links")
    far_pair = painter.camera.to_pixels(np.array([5.0, 4.0]))
    assert measure_min_error(frame, far_pair, LIGHT.final) < 120


def test_only_sensed_obstacle_points_are_marked():
    """Only the second robot senses a point, in the right half of the square."""
    points = np.array([[np.nan, np.nan], [7.0, 1.0]])
    scene = build_scene(TWO, obstacle_points=points)
    frame, painter = render_layers(scene, "obstacle_points")
    color = LIGHT.forces["repulsion_obstacle"]
    assert measure_min_error(frame, painter.camera.to_pixels(points[1]), color) < 30
    pixels, _ = list_pixels(scene, "obstacle_points")
    assert (painter.camera.to_world(pixels.astype(float))[:, 0] > 5.0).all()
