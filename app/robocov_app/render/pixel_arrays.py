"""Surfaces from arrays of colors."""

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.typing import FloatArray
from robocov_app.render.camera import Camera


def build_surface(colors: NDArray[np.uint8]) -> pygame.Surface:
    """Build a surface from an array of colors.

    Parameters
    ----------
    colors : (h, w, 3) or (h, w, 4) array of uint8
        RGB or RGBA values.

    Returns
    -------
    pygame.Surface
    """
    height, width, n_channels = colors.shape
    size = (width, height)
    if n_channels == 4:
        return pygame.image.frombytes(colors.tobytes(), size, "RGBA")
    return pygame.image.frombytes(colors.tobytes(), size, "RGB")


def build_palette_surface(indices: NDArray[np.uint8], palette: NDArray[np.uint8]) -> pygame.Surface:
    """Build a surface with 8 bits per pixel from indices into a palette.

    Parameters
    ----------
    indices : (h, w) array of uint8
        Rows of the palette.
    palette : (p, 3) array of uint8
        RGB values.

    Returns
    -------
    pygame.Surface
    """
    height, width = indices.shape
    surface = pygame.image.frombytes(indices.tobytes(), (width, height), "P")
    surface.set_palette([tuple(color) for color in palette.tolist()])
    return surface


def convert_axes_to_world(
    camera: Camera, columns: FloatArray, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Convert columns and rows of a surface, px, to x and y, m."""
    column_pixels = np.column_stack([columns, np.zeros(len(columns))])
    row_pixels = np.column_stack([np.zeros(len(rows)), rows])
    return camera.to_world(column_pixels)[:, 0], camera.to_world(row_pixels)[:, 1]
