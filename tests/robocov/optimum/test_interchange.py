from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.optimum.interchange import alternated, interchanged, seeded


@st.composite
def tables(draw):
    """Tables of distances, some of points in the plane and some of anything, and a number of sources."""
    sources, targets = draw(st.integers(1, 14)), draw(st.integers(1, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    if draw(st.booleans()):
        one, other = rng.random((sources, 1, 2)), rng.random((targets, 2))
        table = np.hypot(*np.moveaxis(one - other, -1, 0))
    else:
        # with many equal distances
        table = rng.integers(0, 5, (sources, targets)).astype(float)
    return table * rng.integers(1, 4, targets), draw(st.integers(1, sources)), rng


def total(table, sources):
    return table[list(sources)].min(axis=0).sum()


@given(tables())
def test_seeds_are_different_sources(drawn):
    table, count, rng = drawn
    sources = seeded(table, count, rng)
    assert sources.shape == (count,)
    assert len(set(sources.tolist())) == count


def test_seeds_are_far_from_each_other():
    # two clusters far apart: hardly ever both seeds fall into one
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.random((20, 2)), rng.random((20, 2)) + 1000.0])
    table = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
    both = [len(set(seeded(table, 2, np.random.default_rng(k)) < 20)) - 1 for k in range(200)]
    assert sum(both) > 195
    # and a first seed is anywhere
    first = [int(seeded(table, 1, np.random.default_rng(k))[0]) for k in range(400)]
    assert len(set(first)) == 40


@given(tables())
def test_neither_iteration_ever_raises_the_cost(drawn):
    table, count, rng = drawn
    start = rng.choice(len(table), count, replace=False)
    given_ = start.copy()
    for iteration in (alternated, interchanged):
        end = iteration(table, start)
        assert len(set(end.tolist())) == count
        assert total(table, end) <= total(table, start) * (1.0 + 1e-12)
        np.testing.assert_array_equal(start, given_)


@given(tables())
def test_no_swap_is_left_that_would_lower_the_cost(drawn):
    table, count, rng = drawn
    end = interchanged(table, rng.choice(len(table), count, replace=False)).tolist()
    reached = total(table, end)
    for place in range(count):
        for source in range(len(table)):
            swapped = [*end[:place], source, *end[place + 1 :]]
            assert total(table, swapped) >= reached * (1.0 - 1e-8)


@given(tables())
def test_alternation_ends_where_each_source_is_the_best_of_its_own_targets(drawn):
    table, count, rng = drawn
    end = alternated(table, rng.choice(len(table), count, replace=False))
    owner = table[end].argmin(axis=0)
    fresh = []
    for place in range(count):
        sums = table[:, owner == place].sum(axis=1)
        sums[[source for other, source in enumerate(end) if other != place]] = np.inf
        fresh.append(int(sums.argmin()) if (owner == place).any() else int(end[place]))
    if len(set(fresh)) == count:
        assert total(table, fresh) >= total(table, end) * (1.0 - 1e-8)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_interchange_from_some_starts_finds_the_best_of_all(count):
    rng = np.random.default_rng(count)
    one, other = rng.random((12, 1, 2)), rng.random((40, 2))
    table = np.hypot(*np.moveaxis(one - other, -1, 0))
    best = min(total(table, some) for some in combinations(range(12), count))
    found = [total(table, interchanged(table, seeded(table, count, rng))) for _ in range(10)]
    assert min(found) == pytest.approx(best, abs=1e-12)


def test_giving_up():
    table = np.random.default_rng(0).random((20, 50))

    def stop():
        raise KeyboardInterrupt

    for iteration in (alternated, interchanged):
        with pytest.raises(KeyboardInterrupt):
            iteration(table, np.arange(3), stop)
