"""Arrows next to the lines of a robot's report."""

import numpy as np
import pygame
import pytest

from robocov_app.look.theme import THEMES
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.viewer.explanation.explain import RobotReport
from robocov_app.viewer.explanation.sentences import ReportLine
from robocov_app.viewer.panel.panel import show_report

SIZE = (320, 300)
ARROWS = 33
"""Width of the column of arrows, left of the texts, px."""


def draw_lines(*lines: ReportLine) -> np.ndarray:
    """Draw a report with these lines, and return the mask of its drawn pixels, (x, y)."""
    screen = pygame.Surface(SIZE)
    theme = THEMES["light"]
    screen.fill(theme.panel)
    report = RobotReport("Robot 1", "at rest", lines)
    ui = Ui(lambda ui: show_report(ui, report), theme)
    ui.box = screen.get_rect()
    ui.draw(screen)
    return np.any(pygame.surfarray.array3d(screen) != np.array(theme.panel), axis=2)


@pytest.mark.parametrize(("size", "has_arrow"), [(2.0, True), (0.001, True), (0.0004, False), (0.0, False)])
def test_negligible_forces_have_no_arrow(size: float, has_arrow: bool) -> None:
    page = draw_lines(ReportLine("the text of a force", (size, 0.0), "resultant"))
    below_title = page[:, 45:]
    assert below_title[:ARROWS].any() == has_arrow
    assert below_title[ARROWS:].any()


def test_lines_without_a_force_start_at_the_left() -> None:
    assert draw_lines(ReportLine("hears 4 robots", None, ""))[:ARROWS, 45:].any()
