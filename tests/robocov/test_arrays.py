"""Groups of equal values, and concatenated ranges."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robocov.arrays import concatenate_ranges, find_run_starts

numbers = st.lists(st.integers(0, 4), min_size=1, max_size=30)


@given(numbers)
def test_a_run_starts_where_the_value_changes(values):
    values = np.array(values)
    begin = find_run_starts(values)
    np.testing.assert_array_equal(values[begin].repeat(np.diff(begin, append=len(values))), values)
    assert (np.diff(values[begin]) != 0).all()


@given(st.lists(st.tuples(st.integers(-5, 5), st.integers(0, 4)), max_size=20))
def test_concatenated_ranges_agree_with_those_of_python(ranges):
    first = np.array([start for start, _ in ranges], dtype=np.intp)
    count = np.array([size for _, size in ranges], dtype=np.intp)
    expected = []
    for start, size in ranges:
        expected += range(start, start + size)
    assert concatenate_ranges(first, count).tolist() == expected
