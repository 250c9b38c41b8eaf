"""The density layer of frames, and the density in figures."""

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
from robocov_app.figures.map_drawing import build_map_handles, draw_map, set_meter_axes
from robocov_app.look.theme import DARK, LIGHT, Theme
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene

RING = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (2.0, 8.0))
PLAIN = Environment("plain", RING, (CircleObstacle((5.0, 5.0), 0.5),))
HEAVY = PLAIN.with_density(GAUSSIANS["one"])
STARTS = np.array([[3.0, 1.0], [6.0, 2.0], [4.0, 6.0]])


def build_density_scene(environment: Environment) -> Scene:
    """Return the scene of three robots before the first step."""
    simulation = Simulation(environment, Rapf(), STARTS)
    return Scene.from_snapshot(environment, simulation.team, simulation.observe_and_decide())


def build_distance_scene(environment: Environment) -> Scene:
    """Return a scene that has distances, too."""
    cost = CoverageCost(environment, 32)
    field = DistanceField(FieldLattice(cost.sites), cost(STARTS))
    return replace(build_density_scene(environment), field=field, field_limit=5.0)


def build_painter(*layers: str) -> Painter:
    painter = Painter(HEAVY, (400, 380))
    painter.show_only(layers)
    return painter


def render_map(environment: Environment, theme: Theme) -> tuple[np.ndarray, Painter]:
    """Return a frame of the map only, (460, 500, 3), and its painter."""
    painter = Painter(environment, (500, 460), theme)
    painter.show_only({"density", "obstacles", "boundary"})
    return painter.render_frame(build_density_scene(environment)).astype(int), painter


def get_pixel_color(painter: Painter, frame: np.ndarray, x: float, y: float) -> np.ndarray:
    """Return the color at a position in m, (3,)."""
    column, row = np.rint(painter.camera.to_pixels(np.array([x, y]))).astype(int)
    return np.asarray(frame[row, column])


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_the_shading_is_strong_at_the_peak_and_vanishes_far_from_it(theme: Theme) -> None:
    frame, painter = render_map(HEAVY, theme)
    background = np.array(theme.background)
    peak_color = get_pixel_color(painter, frame, 3.0, 3.0)
    expected = background + (np.array(theme.density) - background) * theme.density_strength
    assert np.abs(peak_color - background).max() > 60
    assert np.abs(peak_color - expected).max() < 12
    far_color = get_pixel_color(painter, frame, 7.8, 7.8)
    assert np.abs(far_color - background).max() <= 3


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize(
    ("x", "y"), [pytest.param(0.2, 7.0, id="outside"), pytest.param(5.0, 5.0, id="obstacle")]
)
def test_only_free_space_is_shaded(theme: Theme, x: float, y: float) -> None:
    frame, painter = render_map(HEAVY, theme)
    frame_without_density, _ = render_map(PLAIN, theme)
    color = get_pixel_color(painter, frame, x, y)
    assert (color == get_pixel_color(painter, frame_without_density, x, y)).all()


def test_the_legend_contains_the_range_of_the_density() -> None:
    texts = list_legend_texts(Painter(HEAVY, (500, 460)), build_density_scene(HEAVY))
    assert "density φ, 0.1 to 2.1" in texts


@pytest.mark.parametrize("environment", [PLAIN, PLAIN.with_density(Uniform(2.0))], ids=["none", "uniform"])
def test_the_legend_does_not_contain_a_uniform_density(environment: Environment) -> None:
    texts = list_legend_texts(Painter(HEAVY, (500, 460)), build_density_scene(environment))
    assert not any("φ" in text for text in texts)


def test_the_legend_does_not_contain_a_hidden_density() -> None:
    painter = Painter(HEAVY, (500, 460))
    painter.visible.discard("density")
    texts = list_legend_texts(painter, build_density_scene(HEAVY))
    assert not any("φ" in text for text in texts)


def test_the_density_is_hidden_below_distances() -> None:
    scene = build_distance_scene(HEAVY)
    frame = build_painter("density", "distances", "obstacles").render_frame(scene)
    frame_of_distances = build_painter("distances", "obstacles").render_frame(scene)
    assert np.array_equal(frame, frame_of_distances)


def test_without_distances_the_density_is_visible() -> None:
    painter = build_painter("density", "distances", "obstacles")
    frame_of_distances = painter.render_frame(build_distance_scene(HEAVY))
    frame = painter.render_frame(build_density_scene(HEAVY))
    assert not np.array_equal(frame, frame_of_distances)


def test_another_density_is_redrawn() -> None:
    painter = Painter(PLAIN, (400, 380))
    other = PLAIN.with_density(POLYGONS["rooms"])
    frame = painter.render_frame(build_density_scene(HEAVY))
    other_frame = painter.render_frame(build_density_scene(other))
    assert not np.array_equal(frame, other_frame)
    assert np.array_equal(painter.render_frame(build_density_scene(HEAVY)), frame)


def test_the_density_is_drawn_at_high_zoom() -> None:
    painter = Painter(HEAVY, (400, 380))
    painter.render_frame(build_density_scene(HEAVY))
    painter.camera = painter.camera.zoom_at(40.0, (200, 200))
    frame = painter.render_frame(build_density_scene(HEAVY)).astype(int)
    center_color = frame[200, 200]
    assert frame.shape == (380, 400, 3)
    assert (center_color != LIGHT.background).any()


def test_the_density_of_a_figure_has_its_peak_at_the_same_position() -> None:
    axes = Figure().subplots()
    set_meter_axes(axes, HEAVY, LIGHT)
    draw_map(axes, HEAVY, LIGHT)
    (image,) = axes.images
    opacity = np.asarray(image.get_array())[..., 3]
    n_rows, n_columns = opacity.shape
    row, column = np.unravel_index(opacity.argmax(), opacity.shape)
    assert (column + 0.5) / n_columns * 8.0 == pytest.approx(3.0, abs=0.15)
    assert (row + 0.5) / n_rows * 8.0 == pytest.approx(3.0, abs=0.15)


def test_the_density_does_not_change_the_axes_of_a_figure() -> None:
    axes = Figure().subplots()
    set_meter_axes(axes, HEAVY, LIGHT)
    draw_map(axes, HEAVY, LIGHT)
    assert axes.get_xlim() == (0.0, 8.0)
    assert axes.get_ylim() == (0.0, 8.0)


def test_the_legend_of_a_figure_contains_the_density_if_it_is_drawn() -> None:
    handles = build_map_handles(HEAVY, LIGHT)
    assert handles[-1].get_label() == "density φ, 0.1 to 2.1"
    handles_without_density = build_map_handles(HEAVY, LIGHT, show_density=False)
    assert len(handles_without_density) == len(build_map_handles(PLAIN, LIGHT))


def test_a_figure_without_density_has_no_shading() -> None:
    axes = Figure().subplots()
    draw_map(axes, PLAIN, LIGHT)
    draw_map(axes, HEAVY, LIGHT, show_density=False)
    assert not axes.images
