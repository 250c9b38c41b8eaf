"""The caption above a pane, and the status line below the arena."""

from robocov_app.render.annotations.legend_strip import PADDING_PX, ROW_HEIGHT_PX
from robocov_app.render.annotations.scale_bar import (
    EDGE_PX,
    STRIP_HEIGHT_PX,
    draw_bar,
    is_low_pane,
    measure_bar,
)
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import measure_text, shorten_to_width
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
_STATUS_GAP_PX = 16
"""Space between the scale bar and the status line."""
_CAPTION_GAP_PX = 12
_CAPTION_SIZE_FACTOR = 1.15
_SEPARATOR = "   ·   "


def draw_caption(canvas: Canvas, scene: Scene) -> None:
    """Draw the name of the controller and the coverage cost above a pane."""
    scale = canvas.scale
    left = EDGE_PX * scale
    right = canvas.surface.get_width() - EDGE_PX * scale
    y = (PADDING_PX + 0.5 * ROW_HEIGHT_PX) * scale
    name_size = _CAPTION_SIZE_FACTOR * canvas.theme.text
    gap = _CAPTION_GAP_PX * scale
    costs = _list_shorter_costs(scene.cost)
    name_width = right - left - gap - canvas.measure_text(costs[-1])
    name = shorten_to_width(scene.label, canvas.scale_text_size(name_size), name_width, bold=True)
    left += canvas.draw_text(name, (left, y), size=name_size, bold=True) + gap
    is_low = is_low_pane(canvas.surface.get_height(), scale, canvas.visible_layers)
    if is_low and "scale_bar" in canvas.visible_layers:
        left += draw_bar(canvas, left, y) + gap
    fitting_costs = [cost for cost in costs if canvas.measure_text(cost) <= right - left]
    if fitting_costs:
        canvas.draw_text(fitting_costs[0], (right, y), anchor="right")


def _list_shorter_costs(cost: str) -> list[str]:
    """Return ever shorter texts of a cost: all of it, without the name, and without name and mean time."""
    without_name = cost.replace("mean distance weighted by φ ", "").replace("mean distance ", "")
    return [cost, without_name, without_name.partition(",")[0]]


def draw_status(canvas: Canvas, scene: Scene) -> None:
    """Draw the name of the controller, the time, the coverage cost and the map below the arena."""
    name, text = _choose_status(canvas, scene)
    right = canvas.surface.get_width() - EDGE_PX * canvas.scale
    y = canvas.surface.get_height() - 0.5 * STRIP_HEIGHT_PX * canvas.scale
    canvas.draw_text(text, (right, y), anchor="right")
    name_right = right
    if text:
        name_right -= canvas.measure_text(text)
    canvas.draw_text(name, (name_right, y), anchor="right", bold=True)


def measure_status(canvas: Canvas, scene: Scene) -> float:
    """Return the width of the status line below the arena, px."""
    name, text = _choose_status(canvas, scene)
    return canvas.measure_text(name, bold=True) + canvas.measure_text(text)


def _choose_status(canvas: Canvas, scene: Scene) -> tuple[str, str]:
    """Return the name of the controller and the facts of the status line, as far as they fit."""
    left = (EDGE_PX + _STATUS_GAP_PX) * canvas.scale + measure_bar(canvas)
    right = canvas.surface.get_width() - EDGE_PX * canvas.scale
    size = canvas.scale_text_size(canvas.theme.text)
    name = shorten_to_width(scene.label, size, right - left, bold=True)
    text = fit_status(scene, size, right - left - canvas.measure_text(name, bold=True))
    return name, text


def fit_status(scene: Scene, size: int, width: float) -> str:
    """Return the longest status text that fits into a width, without the name of the controller.

    The facts are the time, the cost and the map; those at the end are dropped first.

    Parameters
    ----------
    scene : Scene
    size : int, px
        Size of the text.
    width : float, px
        Maximum width of the text.

    Returns
    -------
    str
    """
    facts = []
    if scene.snapshot is not None:
        facts.append(f"t = {scene.snapshot.time:.1f} s")
    facts += [fact for fact in (scene.cost, scene.environment.name) if fact]
    if not facts:
        return ""
    lead = ""
    if scene.label:
        lead = _SEPARATOR
    while len(facts) > 1 and measure_text(lead + _SEPARATOR.join(facts), size) > width:
        facts.pop()
    return shorten_to_width(lead + _SEPARATOR.join(facts), size, width)
