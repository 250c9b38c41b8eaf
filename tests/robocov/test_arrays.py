from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robocov.arrays import concatenate_ranges, find_run_starts

numbers = st.lists(st.integers(0, 4), min_size=1, max_size=30)


@given(numbers)
def test_groups_of_equal_values(values):
    values = np.array(values)
    begin = find_run_starts(values)
    np.testing.assert_array_equal(values[begin].repeat(np.diff(begin, append=len(values))), values)
    assert (np.diff(values[begin]) != 0).all()


@given(st.lists(st.tuples(st.integers(-5, 5), st.integers(0, 4)), max_size=20))
def test_ranges(parts):
    first, count = (np.array([part[k] for part in parts], dtype=np.intp) for k in (0, 1))
    expected = [number for begin, size in parts for number in range(begin, begin + size)]
    assert concatenate_ranges(first, count).tolist() == expected
