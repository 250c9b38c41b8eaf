import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication import told
from robocov_app.replication.bars import interval_bar
from robocov_app.replication.contenders import RAPF_DEFAULT, RAPF_SHARED, best
from robocov_app.replication.plan import FULL, QUICK
from robocov_app.replication.verdicts import Criterion

numbers = st.floats(-5.0, 5.0)


def places(svg: str, kind: str) -> list[float]:
    """Return where marks of one kind stand, from left to right along the bar."""
    if kind == "estimate":
        return [float(x) for x in re.findall(r'class="estimate \w+" cx="([\d.]+)"', svg)]
    return [float(x) for x in re.findall(r'class="bound" d="M([\d.]+) ', svg)]


@given(numbers, numbers, numbers, numbers, numbers)
def test_a_bar_keeps_the_order_of_what_it_shows(a, b, c, d, e):
    low, estimate, high = sorted((a, b, c))
    least, most = sorted((d, e))
    svg = str(interval_bar(Criterion("x", Interval(estimate, low, high), least, most)))
    (mark,) = places(svg, "estimate")
    left, right = places(svg, "bound")
    assert 0.0 <= left <= right <= 320.0 and 0.0 <= mark <= 320.0
    if estimate < least:
        assert mark <= left
    if estimate > most:
        assert mark >= right


@pytest.mark.parametrize(
    ("interval", "state"),
    [((0.1, 0.2), "yes"), ((2.0, 3.0), "no"), ((0.5, 1.5), "open"), ((math.nan, math.nan), "open")],
)
def test_a_bar_says_in_words_what_it_shows(interval, state):
    estimate = 0.15 if math.isnan(interval[0]) else sum(interval) / 2
    svg = str(interval_bar(Criterion("x", Interval(estimate, *interval), high=1.0)))
    assert f'class="estimate {state}"' in svg
    assert "wanted: at most 1" in svg and 'role="img"' in svg
    assert ("interval " in svg) is not math.isnan(interval[0])


def test_nothing_to_show_is_no_bar():
    assert str(interval_bar(Criterion("x", Interval(math.nan, math.nan, math.nan), 0.0, 1.0))) == ""


@pytest.mark.parametrize("plan", [FULL, QUICK], ids=lambda plan: plan.name)
def test_the_protocol_tells_every_parameter(plan):
    chosen = {"rapf": best("rapf", RAPF_SHARED.gains), "rpf": best("rpf", {"k_rep": 10.0, "rho_0": 6.0})}
    facts = dict(told.protocol(plan, chosen, 1234, 5))
    text = " ".join(facts.values())
    assert "1,234 runs, 5 of which failed" in text
    for seeds in (plan.tuning, plan.generated, plan.convex_generated, plan.seeds):
        assert told.span(seeds) in text
    for value in (*plan.k_rep, *plan.rho_0, *plan.k_att, plan.duration, plan.dt):
        assert f"{value:g}" in text
    assert all(name in text for name in plan.bundled)
    assert "(k_rep 10, rho_0 6)" in facts["Best gains"]
    assert "robocov" in facts["Versions"]
    only_figures = dict(told.protocol(plan, {}, 8, 0))
    assert "Best gains" not in only_figures and "Robots" in only_figures


def test_gains_as_they_are_read():
    assert told.gains_text(RAPF_SHARED) == "(k_rep 1, rho_0 2, k_att 3, no limit)"
    assert "attraction_limit 2" in told.gains_text(RAPF_DEFAULT)


def test_the_papers_errors_are_told():
    assert len(told.ERRATA) == 3
    assert "(28)" in told.ERRATA[0] and "(18)" in told.ERRATA[1] and "2.0542, 1.6190" in told.ERRATA[2]
