"""The shading of the density in frames and on pages."""

from dataclasses import replace

import numpy as np
import pytest
from density_cases import GAUSSIANS, POLYGONS
from drawn_pixels import list_legend_texts
from matplotlib.figure import Figure

from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.density import Uniform
from robocov.environment import CircleObstacle, Environment
from robocov.simulation import Simulation
from robocov_app.figures.arena import build_map_handles, draw_map, set_meter_axes
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene

RING = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (2.0, 8.0))
PLAIN = Environment("plain", RING, (CircleObstacle((5.0, 5.0), 0.5),))
HEAVY = PLAIN.with_density(GAUSSIANS["one"])
STARTS = np.array([[3.0, 1.0], [6.0, 2.0], [4.0, 6.0]])


def build_density_scene(environment: Environment, **more) -> Scene:
    simulation = Simulation(environment, Rapf(), STARTS)
    return replace(Scene.from_snapshot(environment, simulation.team, simulation.observe_and_decide()), **more)


def get_pixel_color(painter: Painter, frame, x: float, y: float):
    column, row = np.rint(painter.camera.to_pixels(np.array([x, y]))).astype(int)
    return frame[row, column].astype(int)


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_the_shading_covers_the_region(theme):
    frames = {}
    for environment in (PLAIN, HEAVY):
        painter = Painter(environment, (500, 460), theme)
        painter.show_only({"density", "obstacles", "boundary"})
        frames[environment.name, environment is HEAVY] = painter.render_frame(
            build_density_scene(environment)
        )
    plain, heavy = frames.values()
    peak = get_pixel_color(painter, heavy, 3.0, 3.0)
    edge = get_pixel_color(painter, heavy, 7.8, 7.8)
    background = np.array(theme.background)
    assert np.abs(peak - background).max() > 60
    assert np.abs(edge - background).max() <= 3
    wanted = background + (np.array(theme.density) - background) * theme.density_strength
    assert np.abs(peak - wanted).max() < 12
    # outside the region, and on an obstacle, all is as it was
    assert (get_pixel_color(painter, heavy, 0.2, 7.0) == get_pixel_color(painter, plain, 0.2, 7.0)).all()
    assert (get_pixel_color(painter, heavy, 5.0, 5.0) == get_pixel_color(painter, plain, 5.0, 5.0)).all()


def test_the_legend_contains_the_density():
    painter = Painter(HEAVY, (500, 460))
    assert "density φ, 0.1 to 2.1" in list_legend_texts(painter, build_density_scene(HEAVY))
    assert not any("φ" in words for words in list_legend_texts(painter, build_density_scene(PLAIN)))
    assert not any(
        "φ" in words
        for words in list_legend_texts(painter, build_density_scene(PLAIN.with_density(Uniform(2.0))))
    )
    painter.visible.discard("density")
    assert not any("φ" in words for words in list_legend_texts(painter, build_density_scene(HEAVY)))


def test_colors_of_distances_hide_it():
    painter = Painter(HEAVY, (400, 380))
    painter.show_only({"density", "distances", "obstacles"})
    cost = CoverageCost(HEAVY, 32)
    field = DistanceField(FieldLattice(cost.sites), cost(STARTS))
    with_both = painter.render_frame(build_density_scene(HEAVY, field=field, field_limit=5.0))
    painter.show_only({"distances", "obstacles"})
    assert np.array_equal(
        painter.render_frame(build_density_scene(HEAVY, field=field, field_limit=5.0)), with_both
    )
    painter.show_only({"density", "distances", "obstacles"})
    assert not np.array_equal(painter.render_frame(build_density_scene(HEAVY)), with_both)


def test_another_density_is_redrawn():
    painter = Painter(PLAIN, (400, 380))
    first = painter.render_frame(build_density_scene(HEAVY))
    other = PLAIN.with_density(POLYGONS["rooms"])
    second = painter.render_frame(build_density_scene(other))
    assert not np.array_equal(first, second)
    assert np.array_equal(painter.render_frame(build_density_scene(HEAVY)), first)


def test_zoomed_in_it_stays_in_the_view():
    painter = Painter(HEAVY, (400, 380))
    painter.render_frame(build_density_scene(HEAVY))
    painter.camera = painter.camera.zoom_at(40.0, (200, 200))
    assert painter.render_frame(build_density_scene(HEAVY)).shape == (380, 400, 3)


def test_on_a_page():
    axes = Figure().subplots()
    set_meter_axes(axes, HEAVY, LIGHT)
    draw_map(axes, HEAVY, LIGHT)
    (image,) = axes.images
    assert axes.get_xlim() == (0.0, 8.0) and axes.get_ylim() == (0.0, 8.0)
    alpha = np.asarray(image.get_array())[..., 3]
    row, column = np.unravel_index(alpha.argmax(), alpha.shape)
    assert (column + 0.5) / alpha.shape[1] * 8.0 == pytest.approx(3.0, abs=0.15)
    assert (row + 0.5) / alpha.shape[0] * 8.0 == pytest.approx(3.0, abs=0.15)
    assert build_map_handles(HEAVY, LIGHT)[-1].get_label() == "density φ, 0.1 to 2.1"
    bare = Figure().subplots()
    draw_map(bare, PLAIN, LIGHT)
    draw_map(bare, HEAVY, LIGHT, has_density=False)
    assert not bare.images
    assert len(build_map_handles(HEAVY, LIGHT, has_density=False)) == len(build_map_handles(PLAIN, LIGHT))
