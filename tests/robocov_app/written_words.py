"""Finding words in a frame, as a reader would: their ink, and nothing where they have none."""

import numpy as np
import pygame

from robocov_app.look.hues import choose_robot_hues
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import render_text
from robocov_app.render.painter import Painter


def find_words(frame, words, size, theme, color):
    """Return the (x, y) middles of all places where bold `words` stand on the background."""
    alpha = pygame.surfarray.array_alpha(render_text(words, size, color, True)).T.astype(float) / 255
    rows, columns = np.nonzero(alpha)
    alpha = alpha[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    height, width = alpha.shape
    background = np.array(theme.background)
    ink = ((frame - background) / (np.array(color) - background)).mean(axis=2)
    first_y, first_x = np.argwhere(alpha == alpha.max())[0]
    found = []
    for y, x in (np.argwhere(np.abs(ink - alpha.max()) < 0.1) - (first_y, first_x)).tolist():
        seen = ink[max(y, 0) : y + height, max(x, 0) : x + width]
        if seen.shape == alpha.shape and np.abs(seen - alpha).max() < 0.12:
            found.append((x + width / 2, y + height / 2))
    return np.array(found).reshape(-1, 2)


def draw_glyphs(layer, scene, theme, scale=2.0):
    """Return pictures of the glyphs of a layer's legend entries, their middles at (60, 40) px."""
    painter = Painter(scene.environment, (640, 480), theme, scale=scale)
    pictures = []
    for entry in layer.legend(scene):
        surface = pygame.Surface((120, 80), 0, 32)
        surface.fill(theme.background)
        canvas = Canvas(surface, painter.camera, theme, scale, choose_robot_hues(1))
        entry.draw(canvas, 60.0, 40.0)
        pictures.append(pygame.surfarray.array3d(surface).swapaxes(0, 1).astype(int))
    return pictures


def check_glyph(picture, theme, color, scale=2.0):
    """Fail unless a glyph shows a color, around the middle, and within its 22 x 14 px."""
    rows, columns = np.nonzero((picture != np.array(theme.background)).any(axis=2))
    assert len(rows) > 30
    assert abs(columns.min() + columns.max() - 2 * 60) / 2 < 4 * scale
    assert columns.max() - columns.min() <= 22 * scale + 2
    assert rows.max() - rows.min() <= 14 * scale + 2
    assert np.abs(picture - np.array(color)).max(axis=2).min() < 12
