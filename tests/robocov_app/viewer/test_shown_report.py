"""What the inspector's page draws beside its words."""

import numpy as np
import pygame
import pytest

from robocov_app.look.theme import THEMES
from robocov_app.toolkit.ui import Ui
from robocov_app.viewer.explanation.explain import RobotReport
from robocov_app.viewer.explanation.lines import ReportLine
from robocov_app.viewer.panel import show_report

SIZE = (320, 300)
ARROWS = 33  # pixels from the left: arrows are before, words behind


def drawn(*lines: ReportLine) -> np.ndarray:
    """Return which pixels of a page are not its background, (x, y)."""
    screen = pygame.Surface(SIZE)
    theme = THEMES["light"]
    screen.fill(theme.panel)
    report = RobotReport("Robot 1", "at rest", lines)
    ui = Ui(lambda ui: show_report(ui, report), theme)
    ui.box = screen.get_rect()
    ui.draw(screen)
    return np.any(pygame.surfarray.array3d(screen) != np.array(theme.panel), axis=2)


@pytest.mark.parametrize(("size", "arrow"), [(2.0, True), (0.001, True), (0.0004, False), (0.0, False)])
def test_what_is_written_as_no_force_has_no_arrow(size: float, arrow: bool) -> None:
    page = drawn(ReportLine("the text of a force", (size, 0.0), "resultant"))
    below = page[:, 45:]
    assert below[:ARROWS].any() == arrow
    assert below[ARROWS:].any()


def test_a_line_that_is_no_force_begins_at_the_left() -> None:
    assert drawn(ReportLine("hears 4 robots", None, ""))[:ARROWS, 45:].any()
