"""Time and memory for reading large files, compared with the budgets of the handbook."""

from pathlib import Path

import pytest
from budgets import CASES, measure_cases

MAX_BUDGET_SHARE = 3.0
"""More than 1, because test machines are slower and run other processes."""


SMALL_CASES = {"a comb of 4,000 teeth": 0.5}
"""Fractions of the budget that files may use, because larger ones of the same kind must be read, too."""
SIMILAR_CASES = (
    "7,900",
    "140 x 140",
    "a comb of 12,000",
    "a comb of 40,000",
    "a wall of 490,000",
    "noise",
    "rooms",
)
"""Beginnings of the names of cases that are left out, because other cases are similar and faster."""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
@pytest.mark.parametrize("name", [name for name in CASES if not name.startswith(SIMILAR_CASES)])
def test_reading_a_file_stays_within_its_budget(name: str) -> None:
    ((_, cost),) = measure_cases([name], seconds=60.0)
    assert cost.share < MAX_BUDGET_SHARE * SMALL_CASES.get(name, 1.0), cost
