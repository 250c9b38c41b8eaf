"""Annotations around the arena: scale bar, caption and status line."""

from collections.abc import Set

from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import measure_text, shorten_to_width
from robocov_app.render.legend_strip import MARGIN_PX, PADDING_PX, ROW_HEIGHT_PX
from robocov_app.render.scene import Scene

# Lengths in pixels at scale 1.
EDGE_PX = MARGIN_PX + 2.0
"""Space at the sides of texts."""
STRIP_HEIGHT_PX = 34.0
"""Height of the strip below the arena."""
_MAX_LOW_PANE_PX = 240.0
_MIN_BAR_PX = 30.0
"""Minimum space for the scale bar, px of the surface."""
_MAX_BAR_PX = 160
_BAR_TEXT_GAP_PX = 8
_STATUS_GAP_PX = 16
"""Space between the scale bar and the status line."""
_CAPTION_GAP_PX = 12
_CAPTION_SIZE_FACTOR = 1.15
_SEPARATOR = "   ·   "


def is_low_pane(height: float, scale: float, visible_layers: Set[str]) -> bool:
    """Return whether a pane is too low for a strip below the arena; its scale bar is in the caption.

    Parameters
    ----------
    height : float, px
    scale : float
    visible_layers : set of str
        Names of the layers that are drawn.

    Returns
    -------
    bool
    """
    return "caption" in visible_layers and height < _MAX_LOW_PANE_PX * scale


def draw_scale_bar(canvas: Canvas, scene: Scene | None = None) -> None:
    """Draw the scale bar in the strip below the arena, unless it is in the caption."""
    height = canvas.surface.get_height()
    if not is_low_pane(height, canvas.scale, canvas.visible_layers):
        _draw_bar(canvas, EDGE_PX * canvas.scale, height - 0.5 * STRIP_HEIGHT_PX * canvas.scale)


def _draw_bar(canvas: Canvas, left: float, y: float) -> float:
    """Draw a scale bar with its length, and return the width of both, px."""
    length = choose_bar_length(canvas)
    bar_width = length * canvas.camera.zoom
    tick_height = 4.0 * canvas.scale
    thickness = canvas.scale_width(1.5)
    ink = canvas.theme.ink
    for x in (left, left + bar_width):
        tick = (round(x - thickness / 2), round(y - tick_height), thickness, round(2 * tick_height))
        canvas.surface.fill(ink, tick)
    canvas.surface.fill(ink, (round(left), round(y - thickness / 2), round(bar_width), thickness))
    text_left = bar_width + _BAR_TEXT_GAP_PX * canvas.scale
    return text_left + canvas.draw_text(format_scale_length(length), (left + text_left, y), bold=True)


def choose_bar_length(canvas: Canvas) -> float:
    """Choose the length of the scale bar.

    Parameters
    ----------
    canvas : Canvas

    Returns
    -------
    float, m
        A round length that suits the zoom.
    """
    max_width = min(max(canvas.surface.get_width() / 8, _MIN_BAR_PX), _MAX_BAR_PX * canvas.scale)
    return round_down(max_width / canvas.camera.zoom)


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
        left += _draw_bar(canvas, left, y) + gap
    fitting_costs = [cost for cost in costs if canvas.measure_text(cost) <= right - left]
    if fitting_costs:
        canvas.draw_text(fitting_costs[0], (right, y), anchor="right")


def _list_shorter_costs(cost: str) -> list[str]:
    """Return a cost as text, without its name, and without the mean time."""
    without_name = cost.replace("mean distance by φ ", "").replace("mean distance ", "")
    return [cost, without_name, without_name.partition(",")[0]]


def draw_status(canvas: Canvas, scene: Scene) -> None:
    """Draw the name of the controller, the time, the coverage cost and the map below the arena."""
    length = choose_bar_length(canvas)
    bar_width = length * canvas.camera.zoom + canvas.measure_text(format_scale_length(length), bold=True)
    left = (EDGE_PX + _BAR_TEXT_GAP_PX + _STATUS_GAP_PX) * canvas.scale + bar_width
    right = canvas.surface.get_width() - EDGE_PX * canvas.scale
    y = canvas.surface.get_height() - 0.5 * STRIP_HEIGHT_PX * canvas.scale
    size = canvas.scale_text_size(canvas.theme.text)
    name = shorten_to_width(scene.label, size, right - left, bold=True)
    text = fit_status(scene, size, right - left - canvas.measure_text(name, bold=True))
    canvas.draw_text(text, (right, y), anchor="right")
    name_right = right - canvas.measure_text(text) if text else right
    canvas.draw_text(name, (name_right, y), anchor="right", bold=True)


def fit_status(scene: Scene, size: int, width: float) -> str:
    """Return the status without the name of the controller; the least important facts are left out.

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
    time = f"t = {scene.snapshot.time:.1f} s" if scene.snapshot is not None else ""
    facts = [fact for fact in (time, scene.cost, scene.environment.name) if fact]
    if not facts:
        return ""
    lead = _SEPARATOR if scene.label else ""
    while len(facts) > 1 and measure_text(lead + _SEPARATOR.join(facts), size) > width:
        facts.pop()
    return shorten_to_width(lead + _SEPARATOR.join(facts), size, width)
