"""Titles, facts and findings of a report."""

from dataclasses import replace

import numpy as np
import pytest
from reported_results import build_result, build_run

from robocov.errors import format_count
from robocov_app.report.analysis.comparisons import compare_groups
from robocov_app.report.analysis.tuning import choose_compared_groups
from robocov_app.report.facts import (
    format_run_facts,
    format_run_title,
    format_title,
    list_facts,
    list_gain_meanings,
)
from robocov_app.report.findings import describe_incomplete_runs, list_findings, list_problems
from robocov_app.report.results.result import DamagedRun, Reference, ReportedResult

RUNS = [
    build_run("rapf", seed, settled_at_s=None if seed == 0 else 10.0 + seed, contacts=seed % 2)
    for seed in range(5)
]


@pytest.mark.parametrize(
    ("result", "title", "finding"),
    [
        (
            build_result([build_run(final=2.0, settled_at_s=8.04)], kind="run"),
            "RAPF on rooms",
            "At the end the nearest robot is 2.000 m away on average; settled after 8.0 s.",
        ),
        (
            build_result([build_run(final=3.0), build_run("rpf", final=2.0)], kind="comparison"),
            "RAPF, RPF on rooms",
            "Final mean distance to the nearest robot: 2.000 m with RPF, 3.000 m with RAPF, "
            "which is 50% more.",
        ),
        (
            build_result([build_run(final=2.005), build_run("rpf", final=2.0)], kind="comparison"),
            "RAPF, RPF on rooms",
            "Final mean distance to the nearest robot: 2.000 m with RPF, 2.005 m with RAPF, "
            "which is practically the same.",
        ),
        (
            build_result(
                [build_run(final=2.005), build_run("rpf", final=2.0), build_run("lloyd", final=3.0)],
                kind="comparison",
            ),
            "RAPF, RPF, Lloyd on rooms",
            "Final mean distance to the nearest robot: RPF 2.000 m, RAPF 2.005 m, Lloyd 3.000 m (+50%).",
        ),
        (build_result([build_run(final=None)], kind="run"), "RAPF on rooms", "No run has a result."),
        (
            build_result([build_run(final=2.0)]),
            "Sweep study",
            "1 run, median final distance 2.000 m.",
        ),
    ],
)
def test_titles_and_findings_summarize_the_result(result: ReportedResult, title: str, finding: str) -> None:
    assert format_title(result) == title
    comparisons = compare_groups(choose_compared_groups(result).groups)
    assert list_findings(result, comparisons) == [finding]


def test_the_findings_on_a_single_run_have_its_gap_to_the_reference() -> None:
    run = build_run(final=2.2)
    references = {run.setting: Reference(2.0, 0.0)}
    result = replace(build_result([run], kind="run"), references=references)
    (finding,) = list_findings(result, [])
    assert ", a gap of 10.0% to the best known placement" in finding


def test_a_complete_result_has_no_missing_runs() -> None:
    assert describe_incomplete_runs(build_result(RUNS)) == []


def test_missing_failed_and_damaged_runs_are_listed() -> None:
    result = build_result(RUNS, expected_count=6)
    assert describe_incomplete_runs(result) == ["Not finished: 1 of 6 runs is missing."]
    errors = ["no", "no", "a", "b", "c"]
    failed_runs = [build_run("rpf", seed, error=error) for seed, error in enumerate(errors)]
    result = build_result([*RUNS, *failed_runs], expected_count=20)
    result = replace(result, damaged_runs=(DamagedRun("run-7", "no zip file"),))
    assert describe_incomplete_runs(result) == [
        "5 of 10 runs failed (RPF 5 of 5): no; a; b; and 1 more reason.",
        "1 run cannot be read and is left out: run-7 (no zip file).",
        "Not finished: 9 of 20 runs are missing.",
    ]
    assert dict(list_facts(result))["Runs"] == "5 done, 5 failed, 1 unreadable, 9 of 20 missing"


def test_problems_are_counted() -> None:
    assert list_problems(build_result(RUNS)) == [
        "In 2 of 5 runs a robot touched a wall or another robot.",
        "In 1 of 5 runs the team had not settled by the end.",
    ]


def test_problems_of_a_single_run_are_not_counted() -> None:
    stuck_run = build_run(settled_at_s=1.0, stuck_robots=1)
    assert list_problems(build_result([stuck_run])) == ["A robot was stuck at the end."]
    two_stuck = build_run(settled_at_s=1.0, stuck_robots=2)
    assert list_problems(build_result([two_stuck])) == ["2 robots were stuck at the end."]
    one_stuck = build_run("rpf", settled_at_s=1.0, stuck_robots=1)
    assert list_problems(build_result([two_stuck, one_stuck])) == [
        "In 2 of 2 runs up to 2 robots were stuck at the end."
    ]
    assert list_problems(build_result([build_run(settled_at_s=1.0)])) == []
    assert list_problems(build_result([build_run(error="no")])) == []


def test_facts_are_complete_and_short() -> None:
    result = build_result([build_run(seed=seed, robots=n) for seed in range(30) for n in (4, 6)])
    team = {"max_speed_m_per_s": 1.0, "communication_range_m": None, "robots": 4, "mass_kg": [1, 2]}
    versions = {"python": "3.11.7", "robocov": "0.1.0"}
    result = replace(result, facts={**result.facts, "team": team, "versions": versions})
    facts = dict(list_facts(result))
    assert facts["Seeds"] == "0 to 29"
    assert facts["Robots"] == "4, 6"
    assert facts["Duration"] == "6 s"
    long_facts = dict(list_facts(replace(result, facts={**result.facts, "duration_s": 20000.0})))
    assert long_facts["Duration"] == "20000 s"
    assert facts["Team"] == "max speed 1 m/s, unlimited communication range, mass 1 to 2 kg"
    assert facts["Versions"] == "python 3.11.7, robocov 0.1.0"
    assert facts["Control period"] == "100 ms"


def test_many_seeds_are_counted() -> None:
    result = build_result([build_run(seed=number * number) for number in range(20)])
    assert dict(list_facts(result))["Seeds"].endswith("121, … (20)")


def test_only_used_gains_are_explained() -> None:
    result = build_result([build_run(gains=(("k_rep", 0.3),))])
    result = replace(result, gain_meanings={"k_rep": "strength", "k_att": "of others"})
    assert list_gain_meanings(result) == [("k_rep", "strength")]


def test_titles_of_runs_contain_their_differences() -> None:
    runs = [build_run("rapf", seed, start=start) for seed in range(2) for start in ("corner", "spread")]
    assert format_run_title(build_result(runs), runs[0], "RAPF") == "RAPF · corner · seed\u00a00"
    single_run = build_run()
    assert format_run_title(build_result([single_run], kind="run"), single_run, "RAPF") == "RAPF · rooms"


def test_facts_of_a_run_are_its_gains_and_measures() -> None:
    result = build_result(RUNS)
    run = build_run(gains=(("k", 1.0),), settled_at_s=3.0, path_length_m=1.5)
    expected = "Gains: k 1; settled at 3.0 s; 0 contacts; mean path length 1.50 m."
    assert format_run_facts(result, run) == expected
    assert format_count(1, "contact") in format_run_facts(result, build_run(contacts=1))


def test_a_failed_run_has_no_final_distance() -> None:
    assert np.isnan(build_run(error="no").final_distance)
