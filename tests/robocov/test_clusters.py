from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov import clusters
from robocov.clusters import Clusters, coherent_order

some_points = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), min_size=1, max_size=120)


def arrays(points):
    x, y = np.array(points, dtype=float).T
    return np.ascontiguousarray(x), np.ascontiguousarray(y)


def test_runs_of_64_cells_are_squares():
    row, column = np.divmod(np.arange(32 * 32), 32)
    order = coherent_order(column, row).reshape(-1, 64)
    for part in (row[order], column[order]):
        assert (part.max(axis=1) - part.min(axis=1) == 7).all()
    assert sorted(order.ravel().tolist()) == list(range(1024))


@pytest.mark.parametrize("piece", [64, 1 << 18])
@settings(max_examples=60, deadline=None)
@given(some_points, some_points, st.sampled_from([1, 4, 64]))
def test_nearest_is_that_of_the_whole_table(piece, points, others, leaf):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clusters, "_PAIRS", piece)
        (x, y), (ox, oy) = arrays(points), arrays(others)
        order = coherent_order(x.astype(int), y.astype(int))
        x, y = x[order], y[order]
        table = (x[:, None] - ox) ** 2 + (y[:, None] - oy) ** 2
        nearest, distance2 = Clusters(x, y, leaf).nearest(ox, oy)
        np.testing.assert_array_equal(nearest, table.argmin(axis=1))
        np.testing.assert_array_equal(distance2, table.min(axis=1))


@pytest.mark.parametrize("piece", [64, 1 << 18])
@settings(max_examples=60, deadline=None)
@given(some_points, some_points, st.sampled_from([1, 4, 64]), st.integers(0, 2**32))
def test_within_finds_all_pairs_closer_than_the_bound(piece, points, others, leaf, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clusters, "_PAIRS", piece)
        (x, y), (ox, oy) = arrays(points), arrays(others)
        bound = np.random.default_rng(seed).choice([0.0, 1.0, 5.0, 13.0, np.inf], len(x))
        point, other, distance = Clusters(x, y, leaf).within(ox, oy, bound)
        table = np.hypot(x[:, None] - ox, y[:, None] - oy)
        expected = np.argwhere(table < bound[:, None]).tolist()
        assert sorted(zip(point.tolist(), other.tolist(), strict=True)) == [tuple(pair) for pair in expected]
        np.testing.assert_allclose(distance, table[point, other], rtol=1e-15)
        # of one point's others, the first comes first
        for k in range(len(x)):
            assert (np.diff(other[point == k]) > 0).all()


def test_no_points_have_no_nearest():
    none = Clusters(np.empty(0), np.empty(0), 8)
    assert [len(part) for part in none.nearest(np.ones(3), np.ones(3))] == [0, 0]
    assert [len(part) for part in none.within(np.ones(3), np.ones(3), np.empty(0))] == [0, 0, 0]
