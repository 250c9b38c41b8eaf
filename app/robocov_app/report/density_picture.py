"""The density of a map as a small see-through picture, for pages that need nothing else."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.render.density import shading
from robocov_app.render.theme import DARK, LIGHT, mix

if TYPE_CHECKING:
    from robocov.environment import Environment

_DOTS = 80
"""Dots along the longer side of a map."""


def density_picture(environment: Environment) -> str:
    """Return the address, ``data:image/png;...``, of a picture of the density over the region's box.

    The more a place counts, the less is seen through; outside the region all is. Empty where every place
    counts the same.
    """
    from PIL import Image

    density = environment.density
    if density is None or density.uniform:
        return ""
    low_x, low_y, high_x, high_y = bounds = environment.region.bounds
    step = max(high_x - low_x, high_y - low_y) / _DOTS
    columns, rows = (max(round(side / step), 1) for side in (high_x - low_x, high_y - low_y))
    x = low_x + (np.arange(columns) + 0.5) * (high_x - low_x) / columns
    y = high_y - (np.arange(rows) + 0.5) * (high_y - low_y) / rows
    dots = shading(density, bounds, x, y, LIGHT)
    # one colour for light and dark: it is between the two
    dots[..., :3] = mix(LIGHT.density, DARK.density, 0.5)
    places = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    dots[~environment.region.contains(places).reshape(rows, columns), 3] = 0
    file = io.BytesIO()
    Image.fromarray(dots).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
