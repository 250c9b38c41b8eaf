"""Layers of a picture, and their entries in the legend."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from robocov_app.render.canvas import Canvas, Glyph, LegendEntry
from robocov_app.render.scene import Scene

LegendBuilder: TypeAlias = Callable[[Scene], list[LegendEntry]]
"""Builds the legend entries of a layer for a scene."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A part of a picture that can be shown or hidden.

    Attributes
    ----------
    name : str
        Identifier, as in options of commands.
    title : str
        Name in the window.
    draw : callable
        Draws the layer of a scene on a canvas.
    needs : tuple of str
        Attributes that the scene must have, otherwise the layer is not drawn.
    legend : LegendBuilder
    is_default : bool
        Whether the layer is shown by default.
    is_static : bool
        Whether the layer depends only on the map, the camera and the theme.
    is_in_world : bool
        Whether the layer is drawn only within the view of the camera.
    needs_goals : bool
        Whether the layer is empty for controllers without goals, such as RPF.
    """

    name: str
    title: str
    draw: Callable[[Canvas, Scene], None]
    needs: tuple[str, ...] = ()
    legend: LegendBuilder = lambda scene: []
    is_default: bool = True
    is_static: bool = False
    is_in_world: bool = True
    needs_goals: bool = False

    def can_draw(self, scene: Scene) -> bool:
        """Return whether a scene has all attributes that the layer needs."""
        return all(scene.has_content(name) for name in self.needs)


def build_legend(
    text: str, glyph: Glyph, applies_to: Callable[[Scene], bool] = lambda scene: True
) -> LegendBuilder:
    """Build the legend of a layer that has a single entry.

    Parameters
    ----------
    text : str
    glyph : Glyph
        Draws the symbol.
    applies_to : callable
        Returns whether the entry is shown for a scene; by default it always is.

    Returns
    -------
    LegendBuilder
    """
    return lambda scene: [LegendEntry(text, glyph)] if applies_to(scene) else []
