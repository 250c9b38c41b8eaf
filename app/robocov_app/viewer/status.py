"""The status line: time, cost, speed, and what the place under the cursor adds to the cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygame

from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import shortened
from robocov_app.render.theme import mix
from robocov_app.viewer.session.clock import speed_words

if TYPE_CHECKING:
    from robocov_app.render.theme import Theme
    from robocov_app.toolkit.layout import Layout
    from robocov_app.viewer.presenter import Desk

HINT = "Space pause · F1 keys"
_SLOW = 30.0  # frames per second
_FLAT = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))


def facts(desk: Desk, frames: float, steps: float, filmed: float | None) -> list[str]:
    """Return what the line says, the most important first.

    Parameters
    ----------
    desk : Desk
    frames, steps : float
        Per second.
    filmed : float or None, s
        Length of the film that is being recorded.
    """
    session = desk.session
    known = desk.costs.known.get(desk.lane.number)
    said = [f"{'' if session.playing else 'paused · '}t = {session.time:.2f} s"]
    if known is not None:
        when = f" (at {known.time:.1f} s)" if abs(known.time - session.time) > 0.05 else ""
        said.append(f"J = {known.result.value:.2f} m³{when}")
        if known.result.uncovered_area > 1e-9:
            said.append(f"cut off {known.result.uncovered_area:.1f} m²")
    if filmed is not None:
        said.append(f"● film {filmed:.0f} s")
    speed, rate = speed_words(session.clock.speed), f"{frames:.0f} fps"
    if session.playing and session.clock.behind:
        speed += f", really {steps * session.scenario.dt:.1f}×"
    rest = [cursor_words(desk), speed, f"{steps:.0f} steps/s"]
    said += [rate, *rest] if frames < _SLOW else [*rest, rate]  # the first thing to know if it is low
    return [each for each in said if each]


def cursor_words(desk: Desk) -> str:
    """Return where the cursor is, and what the place adds to the cost."""
    if desk.cursor is None:
        return ""
    x, y = desk.cursor
    words = f"({x:.2f}, {y:.2f}) m"
    lane = desk.session.lanes[min(desk.cursor_pane, len(desk.session.lanes) - 1)]
    known = desk.costs.known.get(lane.number)
    if known is None:
        return words
    result = known.result
    square = (result.points[:, 0] - x) ** 2 + (result.points[:, 1] - y) ** 2
    site = int(square.argmin())
    if square[site] > (1.5 * known.lattice().spacing) ** 2:
        return f"{words}: not free"
    owner = int(result.owner[site])
    numbers = desk.session.circumstances(lane).numbers
    if not 0 <= owner < len(numbers):
        return f"{words}: no robot can come"
    distance = float(result.distances[site])
    share = distance / result.mean_distance if result.mean_distance > 0 else 0.0
    return f"{words}: {distance:.2f} m to robot {numbers[owner]}, {share:.1f} × the mean"


def draw_status(
    screen: pygame.Surface, layout: Layout, theme: Theme, said: list[str], hint: str = HINT
) -> None:
    """Draw the line; what there is no room for is left out, from the end."""
    scale = layout.scale
    left, top, width, height = layout.status
    screen.fill(mix(theme.panel, theme.ink, 0.06), pygame.Rect(layout.status))
    canvas = Canvas(screen, _FLAT, theme, scale, np.zeros(1, dtype=np.intp))
    size = theme.small_text
    room = width - 44 * scale - canvas.text_width(hint, size)
    kept = list(said)
    while len(kept) > 1 and canvas.text_width("    ".join(kept), size) > room:
        kept.pop()
    y = top + height / 2
    words = shortened("    ".join(kept), canvas.text_size(size), room)
    canvas.text(words, (left + 12 * scale, y), size=size)
    canvas.text(hint, (left + width - 12 * scale, y), size=size, colour=theme.faint, anchor="right")
