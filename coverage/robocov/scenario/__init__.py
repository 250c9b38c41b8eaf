"""Scenarios: complete descriptions of runs, and how to run and compare them.

- `scenario`: everything that the result of one run depends on
- `scenario_document`: the JSON form of a scenario
- `comparison`: several controllers in the same scenario
"""

from robocov.scenario.comparison import Comparison, compare, format_comparison
from robocov.scenario.scenario import MAX_RECORD_ROWS, Scenario, run

__all__ = ["MAX_RECORD_ROWS", "Comparison", "Scenario", "compare", "format_comparison", "run"]
