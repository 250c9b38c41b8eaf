"""Frames of single layers, and colors at their pixels."""

import numpy as np
import shapely

from robocov_app.look.theme import LIGHT
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.painter import Painter

SIZE = (480, 360)
ONE = np.array([[4.0, 4.0]])
TWO = np.array([[2.0, 2.0], [6.0, 6.0]])


def find_layer(name, layers=None):
    """Return a layer by its name."""
    (layer,) = [layer for layer in layers or build_standard_layers() if layer.name == name]
    return layer


def render_layers(scene, *names, size=SIZE, theme=LIGHT, layers=None):
    """Return a frame with only these layers, (height, width, 3), and its painter."""
    painter = Painter(scene.environment, size, theme, layers)
    painter.show_only(names)
    return painter.render_frame(scene).astype(int), painter


def list_legend_texts(painter, scene):
    """Return the texts of the legend of a scene."""
    return [entry.text for entry in painter.list_legend_entries(scene)]


def list_pixels(scene, *names, size=SIZE):
    """Return the (x, y) pixels that these layers draw, (n, 2), and the painter."""
    frame, painter = render_layers(scene, *names, size=size)
    rows, columns = np.nonzero((frame != np.array(LIGHT.background)).any(axis=2))
    return np.column_stack([columns, rows]), painter


def measure_error(frame, pixel, color):
    """Return the maximum difference of a channel at a pixel from a color."""
    x, y = np.rint(pixel).astype(int)
    return int(np.abs(frame[y, x] - np.array(color)).max())


def measure_min_error(frame, pixel, color, reach=1):
    """Return the minimum of `measure_error` over the pixels around a pixel."""
    x, y = np.rint(pixel).astype(int)
    return min(
        measure_error(frame, (x + dx, y + dy), color)
        for dx in range(-reach, reach + 1)
        for dy in range(-reach, reach + 1)
    )


def sample_inside(geometry, count, seed=0):
    """Return random points in a geometry, (count, 2) m."""
    low_x, low_y, high_x, high_y = geometry.bounds
    points = np.random.default_rng(seed).uniform((low_x, low_y), (high_x, high_y), size=(20 * count, 2))
    return points[shapely.contains_xy(geometry, points)][:count]
