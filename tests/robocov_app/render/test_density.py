"""Shading and descriptions of the density."""

import numpy as np
import pygame
import pytest
from density_cases import GAUSSIANS, POLYGONS

from robocov.density import Gaussian, Gaussians, Raster, Uniform, WeightedArea, WeightedPolygons
from robocov.environment import Environment
from robocov_app.look.colors import compute_contrast, mix
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.density_shading import (
    color_density,
    compute_density_fractions,
    compute_density_range,
    get_density_range,
)
from robocov_app.render.density_text import describe_density, get_cost_name
from robocov_app.render.layers.density import draw_density_shading

BOUNDS = (0.0, 0.0, 8.0, 8.0)
SQUARE = Environment("square", ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)))


def shade(density, x, theme=LIGHT):
    """Return the shading of a density on a grid with equal x and y in m, (k, k, 4) RGBA."""
    return color_density(compute_density_fractions(density, BOUNDS, x, x), theme)


@pytest.mark.parametrize(
    "density", [None, Uniform(3.0), Gaussians((), 2.0), Raster(np.ones((2, 2)), BOUNDS)], ids=repr
)
def test_a_uniform_density_is_not_described(density):
    environment = SQUARE.with_density(density)
    assert describe_density(environment) == ""
    assert get_cost_name(environment) == "mean distance"


def test_a_nonuniform_density_is_described_with_its_range():
    environment = SQUARE.with_density(POLYGONS["rooms"])
    assert describe_density(environment) == "density φ, 0.3 to 4"
    assert get_cost_name(environment) == "mean distance weighted by φ"


def test_the_range_includes_narrow_peaks_inside_the_bounds():
    peak = Gaussian((3.21, 4.56), 7.0, sigma=0.01)
    peak_outside = Gaussian((90.0, 0.0), 50.0, sigma=0.1)
    low, high = compute_density_range(Gaussians((peak, peak_outside), 0.5), BOUNDS)
    assert low == pytest.approx(0.5)
    assert high == pytest.approx(7.5)


@pytest.mark.parametrize("bounds", [(0.0, 0.0, 400.0, 1.0), (0.0, 0.0, 1.0, 400.0)], ids=["wide", "high"])
def test_the_range_is_known_for_a_long_narrow_map(bounds):
    density = Raster(np.array([[1.0, 2.0], [4.0, 5.0]]), bounds)
    low, high = compute_density_range(density, bounds)
    assert 1.0 <= low < high <= 5.0


def test_an_edge_between_distant_corners_is_shaded_where_it_is():
    corners = np.array([[0.0, 0.0], [200.0, 0.0], [0.0, 100.0]])
    density = WeightedPolygons((WeightedArea(((40.0, 80.0), (41.0, 80.0), (40.0, 81.0)), 0.2),))
    # The middle of the view is on the longest edge.
    camera = Camera((40.0, 80.0), 1000.0, (0.0, 0.0, 200.0, 100.0))
    surface = pygame.Surface((200, 100))
    surface.fill(LIGHT.background)
    canvas = Canvas(surface, camera, LIGHT, 1.0, choose_robot_hues(0))
    draw_density_shading(canvas, density, corners)
    is_shaded = (pygame.surfarray.array3d(surface) != np.array(LIGHT.background)).any(axis=2)
    x, y = np.meshgrid(np.arange(200) + 0.5, np.arange(100) + 0.5, indexing="ij")
    distance_below_edge = (y - 50.0) - (x - 100.0) / 2.0
    assert is_shaded[distance_below_edge > 2.0].all()
    assert not is_shaded[distance_below_edge < -2.0].any()


def test_the_range_of_a_map_without_density_is_one():
    assert get_density_range(SQUARE) == (1.0, 1.0)


def test_shading_is_stronger_where_the_density_is_higher():
    x = np.linspace(0.1, 7.9, 60)
    opacity = shade(GAUSSIANS["one"], x)[..., 3].astype(int)
    points_x, points_y = np.meshgrid(x, x)
    values = GAUSSIANS["one"].evaluate(np.column_stack([points_x.ravel(), points_y.ravel()]))
    opacity_by_density = opacity.ravel()[np.argsort(values)]
    assert (np.diff(opacity_by_density) >= 0).all()


def test_shading_has_one_color_and_the_opacity_of_the_theme():
    image = shade(GAUSSIANS["one"], np.linspace(0.1, 7.9, 60))
    assert image.shape == (60, 60, 4)
    assert (image[..., :3] == LIGHT.density).all()
    assert image[..., 3].min() == 0
    assert image[..., 3].max() == pytest.approx(255 * LIGHT.density_strength, abs=3)


def test_a_uniform_density_has_no_shading():
    image = shade(Uniform(), np.linspace(0.1, 7.9, 60))
    assert not image[..., 3].any()


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_the_strongest_shading_contrasts_with_the_background_and_with_marks(theme):
    opacity = float(color_density(np.array([1.0]), theme)[0, 3]) / 255.0
    shading = mix(theme.background, theme.density, opacity)
    assert compute_contrast(shading, theme.background) > 1.4
    assert compute_contrast(shading, theme.ink) > 4.5
    assert compute_contrast(shading, theme.trajectory) > 1.3
