from itertools import pairwise

import numpy as np
import pytest
from drawn_run import ROOMS
from hypothesis import given
from hypothesis import strategies as st

from robocov.cost import CoverageCost
from robocov_app.render.field import Borders, Field, FieldLattice
from robocov_app.render.shading import FARTHEST, levels, palette, round_limit, strength, ticks
from robocov_app.render.theme import DARK, LIGHT, contrast, luminance

THEMES = [LIGHT, DARK]


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
def test_colours_run_one_way_from_the_page_to_its_opposite(theme):
    brightness = np.array([luminance(tuple(colour)) for colour in theme.heat_table(254).tolist()])
    steps = np.diff(brightness) * (1 if theme is DARK else -1)
    assert (steps >= -1e-3).all()
    # every tenth of the scale can be told from the next
    tenths = [tuple(colour) for colour in theme.heat_table(11).tolist()]
    assert min(contrast(one, two) for one, two in pairwise(tenths)) > 1.08
    assert contrast(tenths[0], theme.background) < 1.1
    assert contrast(tenths[-1], theme.background) > 7.0


@given(st.floats(1e-3, 1e5))
def test_scales_end_at_round_lengths_not_far_beyond(distance):
    limit = round_limit(distance)
    assert distance * (1 - 1e-9) <= limit <= 1.51 * distance
    marks = ticks(limit)
    assert marks[0] == 0.0
    assert marks[-1] == pytest.approx(limit)
    assert 3 <= len(marks) <= 6
    assert np.ptp(np.diff(marks)) <= 1e-9 * limit


def test_levels_follow_the_distances_up_to_the_limit():
    cost = CoverageCost(ROOMS, 64)
    field = Field(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    x, y = np.linspace(0.1, 15.9, 60), np.linspace(9.9, 0.1, 40)
    distance = field.distances(x, y)
    level = levels(field, x, y, 5.0, 9)
    assert (level[np.isfinite(distance)] <= FARTHEST).all()
    assert (level[np.isfinite(distance) & (distance >= 5.0)] == FARTHEST).all()
    near = distance < 5.0
    np.testing.assert_allclose(level[near] / FARTHEST * 5.0, distance[near], atol=5.0 / FARTHEST)


def test_where_nobody_can_come_is_hatched():
    cost = CoverageCost(ROOMS, 32)
    field = Field(FieldLattice(cost.sites), cost(np.array([[2.0, 2.0]])))
    courtyard = levels(field, np.linspace(1.8, 3.2, 50), np.linspace(8.6, 7.8, 30), 5.0, 9)
    assert set(np.unique(courtyard)) == {FARTHEST + 1, FARTHEST + 2}
    assert 0.05 < (courtyard == FARTHEST + 2).mean() < 0.2
    for theme in THEMES:
        colours = palette(theme)
        assert colours.shape == (256, 3)
        assert tuple(colours[FARTHEST + 1]) == theme.unreached


def test_lines_are_as_wide_as_asked_for_and_smooth():
    gap = np.linspace(0.0, 0.1, 1001)
    none = np.zeros(1001, dtype=np.intp)
    part = strength(Borders(none, none, none, gap), zoom=50.0, width=3.0)
    assert part[0] == 1.0
    assert part[gap * 50 > 2.0].max() == 0.0
    # half its width on this side
    assert part.sum() * (gap[1] * 50) == pytest.approx(1.5, abs=0.01)
