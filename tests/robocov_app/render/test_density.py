"""The density as colors and in words."""

import numpy as np
import pytest
from density_cases import GAUSSIANS, POLYGONS

from robocov.density import Gaussian, Gaussians, Raster, Uniform
from robocov.environment import Environment
from robocov_app.look.colors import compute_contrast, mix
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.density_shading import (
    color_density,
    compute_density_fractions,
    compute_density_range,
    get_density_range,
)
from robocov_app.render.density_text import describe_density, get_cost_name

BOUNDS = (0.0, 0.0, 8.0, 8.0)
SQUARE = Environment("square", ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)))


def test_only_nonuniform_densities_are_described():
    for density in (None, Uniform(3.0), Gaussians((), 2.0), Raster(np.ones((2, 2)), BOUNDS)):
        assert describe_density(SQUARE.with_density(density)) == ""
        assert get_cost_name(SQUARE.with_density(density)) == "mean distance"
    assert describe_density(SQUARE.with_density(POLYGONS["rooms"])) == "density φ, 0.3 to 4"
    assert get_cost_name(SQUARE.with_density(POLYGONS["rooms"])) == "mean distance weighted by φ"


def test_the_range_finds_narrow_hot_spots():
    narrow = Gaussians((Gaussian((3.21, 4.56), 7.0, sigma=0.01), Gaussian((90.0, 0.0), 50.0, sigma=0.1)), 0.5)
    low, high = compute_density_range(narrow, BOUNDS)
    assert low == pytest.approx(0.5) and high == pytest.approx(7.5)
    assert get_density_range(SQUARE) == (1.0, 1.0)


def test_the_more_the_stronger():
    x = np.linspace(0.1, 7.9, 60)
    picture = color_density(compute_density_fractions(GAUSSIANS["one"], BOUNDS, x, x), LIGHT)
    assert picture.shape == (60, 60, 4) and (picture[..., :3] == LIGHT.density).all()
    values = GAUSSIANS["one"].evaluate(np.column_stack([np.tile(x, 60), np.repeat(x, 60)])).reshape(60, 60)
    order = np.argsort(values.ravel())
    assert (np.diff(picture[..., 3].ravel()[order].astype(int)) >= 0).all()
    assert picture[..., 3].min() == 0
    assert picture[..., 3].max() == pytest.approx(255 * LIGHT.density_strength, abs=3)
    flat = color_density(compute_density_fractions(Uniform(), BOUNDS, x, x), LIGHT)
    assert not flat[..., 3].any()


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_the_density_is_visible_and_hides_nothing(theme):
    alpha = float(color_density(np.array([1.0]), theme)[0, 3]) / 255.0
    full = mix(theme.background, theme.density, alpha)
    assert compute_contrast(full, theme.background) > 1.4
    assert compute_contrast(full, theme.ink) > 4.5
    assert compute_contrast(full, theme.trajectory) > 1.3
