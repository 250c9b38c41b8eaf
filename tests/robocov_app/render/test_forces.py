from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import (
    ONE,
    TWO,
    find_layer,
    list_legend_texts,
    list_pixels,
    measure_least_error,
    render_layers,
)
from drawn_run import build_scene
from hypothesis import given, settings
from hypothesis import strategies as st
from rendered_text import check_legend_symbol, render_legend_symbols

from robocov.team import Team
from robocov_app.look.theme import DARK, LIGHT


@settings(deadline=None, max_examples=25)
@given(st.floats(0, 2 * np.pi), st.sampled_from(["velocities", "force_attraction", "force_resultant"]))
def test_arrows_have_the_direction_of_their_vectors(angle, name):
    direction = np.array([np.cos(angle), np.sin(angle)])
    scene = build_scene(ONE, forces=1.5 * direction[None], velocities=0.9 * direction[None])
    pixels, painter = list_pixels(scene, name)
    away = painter.camera.to_world(pixels.astype(float)) - ONE[0]
    middle = away.mean(axis=0) / np.linalg.norm(away.mean(axis=0))
    assert middle @ direction > 0.98
    assert (away @ direction).min() > 0  # it begins at the disc, not behind it


@pytest.mark.parametrize("term", ["attraction", "repulsion_robots", "repulsion_obstacle", "resultant"])
def test_stronger_forces_have_longer_arrows_within_limits(term):
    reach = []
    for force in (0.0, 0.5, 2.0, 1e3, 1e9):
        pixels, painter = list_pixels(build_scene(ONE, forces=np.array([[force, 0.0]])), f"force_{term}")
        center = painter.camera.to_pixels(ONE)[0]
        reach.append((pixels[:, 0] - center[0]).max() if len(pixels) else 0.0)
    assert reach[0] == 0.0
    assert reach[0] < reach[1] < reach[2] < reach[3]
    assert reach[3] == pytest.approx(reach[4], abs=1.01)
    assert reach[4] < 75


def test_terms_differ_by_more_than_hue():
    shapes = set()
    for term in ("attraction", "repulsion_robots", "repulsion_obstacle"):
        pixels, _ = list_pixels(build_scene(ONE, forces=np.array([[1.0, 0.0]])), f"force_{term}")
        shapes.add(tuple(map(tuple, pixels.tolist())))
    pixels, _ = list_pixels(build_scene(ONE, velocities=np.array([[-1.0, 0.0]])), "force_viscosity")
    shapes.add(tuple(map(tuple, pixels.tolist())))
    assert len(shapes) == 4


def build_gliding_scene(*velocity, viscosity=1.0, positions=ONE):
    """Return a scene of robots of one velocity in a world of a viscosity."""
    scene = build_scene(positions, velocities=np.tile(np.array(velocity, dtype=float), (len(positions), 1)))
    return replace(scene, team=Team.homogeneous(len(positions), viscosity=viscosity))


@settings(deadline=None, max_examples=25)
@given(st.floats(0, 2 * np.pi))
def test_viscosity_points_against_the_velocity(angle):
    direction = np.array([np.cos(angle), np.sin(angle)])
    pixels, painter = list_pixels(build_gliding_scene(*0.8 * direction), "force_viscosity")
    away = painter.camera.to_world(pixels.astype(float)) - ONE[0]
    middle = away.mean(axis=0) / np.linalg.norm(away.mean(axis=0))
    assert middle @ -direction > 0.98
    assert (away @ -direction).min() > 0


def test_viscosity_ends_in_a_bar_across():
    """It is no arrow: it pulls nowhere, it only slows down."""
    pixels, painter = list_pixels(build_gliding_scene(-0.8, 0.0), "force_viscosity")
    center = painter.camera.to_pixels(ONE)[0]
    heights = [np.ptp(pixels[pixels[:, 0] == x][:, 1]) for x in range(pixels[:, 0].min(), pixels[:, 0].max())]
    assert max(heights[:-6]) <= 4 * painter.scale
    assert max(heights[-6:]) >= 6 * painter.scale
    assert abs(pixels[:, 1].mean() - center[1]) < 1


def test_viscosity_grows_with_speed_and_with_the_worlds_viscosity():
    reach = []
    for speed, viscosity in ((0.0, 1.0), (0.3, 1.0), (0.9, 1.0), (0.9, 3.0), (0.9, 1e5), (0.9, 0.0)):
        pixels, painter = list_pixels(build_gliding_scene(speed, 0.0, viscosity=viscosity), "force_viscosity")
        center = painter.camera.to_pixels(ONE)[0]
        reach.append((center[0] - pixels[:, 0]).max() if len(pixels) else 0.0)
    assert reach[0] == reach[5] == 0.0
    assert 10 < reach[1] < reach[2] < reach[3] < reach[4] < 75


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_viscosity_has_its_own_color_and_legend(theme):
    scene = build_gliding_scene(-0.9, 0.0)
    frame, painter = render_layers(scene, "force_viscosity", theme=theme)
    start = painter.camera.to_pixels(ONE)[0] + np.array([14.0 * painter.scale, 0.0])
    assert measure_least_error(frame, start, theme.forces["viscosity"]) < 25
    assert list_legend_texts(painter, scene) == ["viscosity"]
    (picture,) = render_legend_symbols(find_layer("force_viscosity"), scene, theme)
    check_legend_symbol(picture, theme, theme.forces["viscosity"])


def test_viscosity_of_robots_out_of_sight_is_left_out():
    pixels, _ = list_pixels(
        build_gliding_scene(0.9, 0.0, positions=np.array([[500.0, 4.0], [4.0, -900.0]])), "force_viscosity"
    )
    assert len(pixels) == 0


@pytest.mark.parametrize("kind", ["sensing", "communication"])
def test_ranges_are_circles_of_their_radius(kind):
    scene = build_scene(ONE, sensing_range=2.5, communication_range=2.5)
    pixels, painter = list_pixels(scene, kind)
    radius = np.linalg.norm(pixels - painter.camera.to_pixels(ONE)[0], axis=1)
    assert np.abs(radius - 2.5 * painter.camera.zoom).max() < 2.5
    angle = np.arctan2(*(pixels - painter.camera.to_pixels(ONE)[0]).T)
    assert len(np.unique(np.round(angle, 1))) > 50


def test_unlimited_ranges_are_not_drawn():
    scene = build_scene(ONE, communication_range=np.inf)
    pixels, painter = list_pixels(scene, "communication")
    assert len(pixels) == 0
    assert list_legend_texts(painter, scene) == []


def test_links_are_those_of_the_graph():
    three = np.array([[1.0, 4.0], [3.0, 4.0], [7.0, 4.0]])
    near = build_scene(three, communication_range=2.5)
    frame, painter = render_layers(near, "links")
    link, none = painter.camera.to_pixels(np.array([[2.0, 4.0], [5.0, 4.0]]))
    assert measure_least_error(frame, link, LIGHT.final) < 120
    assert measure_least_error(frame, none, LIGHT.background) == 0
    frame, _ = render_layers(build_scene(three), "links")  # all hear all: cells that share an edge
    assert measure_least_error(frame, none, LIGHT.final) < 120


def test_sensed_obstacle_points_are_marked():
    points = np.array([[np.nan, np.nan], [7.0, 1.0]])
    scene = build_scene(TWO, obstacle_points=points)
    frame, painter = render_layers(scene, "obstacle_points")
    assert (
        measure_least_error(frame, painter.camera.to_pixels(points[1]), LIGHT.forces["repulsion_obstacle"])
        < 30
    )
    pixels, _ = list_pixels(scene, "obstacle_points")
    assert (painter.camera.to_world(pixels.astype(float))[:, 0] > 5.0).all()  # robot 1 senses none
