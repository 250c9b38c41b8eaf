"""Texts and symbols of legends in rendered frames."""

import numpy as np
import pygame

from robocov_app.look.hues import choose_robot_hues
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import render_text
from robocov_app.render.painter import Painter

MAX_CANDIDATE_ERROR = 0.1
"""Maximum error of the opacity at the most opaque pixel of a text."""
MAX_ERROR = 0.12
"""Maximum error of the opacity at any pixel of a text."""

SYMBOL_IMAGE_SIZE_PX = (120, 80)
SYMBOL_CENTER_PX = (60.0, 40.0)
SYMBOL_SIZE_PX = (22, 14)
"""Maximum size of a symbol at scale 1."""
MIN_SYMBOL_PIXELS = 30
MAX_COLOR_ERROR = 12


def find_text(frame, text, size, theme, color):
    """Return the centers of all positions at which a bold text is on the background, (n, 2) px.

    Both the inked and the empty pixels of the text have to match.
    """
    alpha = pygame.surfarray.array_alpha(render_text(text, size, color, bold=True)).T.astype(float) / 255
    rows, columns = np.nonzero(alpha)
    alpha = alpha[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    height, width = alpha.shape
    background = np.array(theme.background)
    opacity = ((frame - background) / (np.array(color) - background)).mean(axis=2)
    opaque_y, opaque_x = np.argwhere(alpha == alpha.max())[0]
    candidates = np.argwhere(np.abs(opacity - alpha.max()) < MAX_CANDIDATE_ERROR) - (opaque_y, opaque_x)
    centers = []
    for y, x in candidates.tolist():
        part = opacity[max(y, 0) : y + height, max(x, 0) : x + width]
        if part.shape == alpha.shape and np.abs(part - alpha).max() < MAX_ERROR:
            centers.append((x + width / 2, y + height / 2))
    return np.array(centers).reshape(-1, 2)


def render_legend_symbols(layer, scene, theme, scale=2.0):
    """Return an image of each symbol in the legend of a layer, with its center at `SYMBOL_CENTER_PX`."""
    painter = Painter(scene.environment, (640, 480), theme, scale=scale)
    images = []
    for entry in layer.legend(scene):
        surface = pygame.Surface(SYMBOL_IMAGE_SIZE_PX, 0, 32)
        surface.fill(theme.background)
        canvas = Canvas(surface, painter.camera, theme, scale, choose_robot_hues(1))
        entry.draw(canvas, *SYMBOL_CENTER_PX)
        images.append(pygame.surfarray.array3d(surface).swapaxes(0, 1).astype(int))
    return images


def check_legend_symbol(image, theme, color, scale=2.0):
    """Check that a symbol contains a color, is centered, and fits into its cell of the legend."""
    rows, columns = np.nonzero((image != np.array(theme.background)).any(axis=2))
    width, height = SYMBOL_SIZE_PX
    center_x, _ = SYMBOL_CENTER_PX
    assert len(rows) > MIN_SYMBOL_PIXELS
    assert abs((columns.min() + columns.max()) / 2 - center_x) < 4 * scale
    assert columns.max() - columns.min() <= width * scale + 2
    assert rows.max() - rows.min() <= height * scale + 2
    assert np.abs(image - np.array(color)).max(axis=2).min() < MAX_COLOR_ERROR
