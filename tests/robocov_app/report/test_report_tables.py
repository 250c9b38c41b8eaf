"""The tables of a report, and what it says in words."""

from __future__ import annotations

import numpy as np
import pytest
from reported_results import entry, result_of

from robocov.errors import counted
from robocov_app.report.facts import (
    facts,
    gaps,
    lede,
    pairs_words,
    run_facts,
    run_title,
    title_of,
    troubles,
)
from robocov_app.report.groups import CLUSTERS, comparisons
from robocov_app.report.result_plots import styles
from robocov_app.report.tables import (
    MOST_ROWS,
    NOTHING,
    controllers_table,
    failures_table,
    gains_table,
    pairs_table,
    runs_table,
    summary_tables,
)

FIVE = [
    entry(
        "rapf",
        k,
        value,
        settled_at_s=None if k == 0 else 10.0 + k,
        contacts=k % 2,
        min_clearance_m=-0.001 * k,
    )
    for k, value in enumerate([1.0, 2.0, 3.0, 4.0, 5.0])
]


def texts(table) -> list[list[str]]:
    return [[cell.text for cell in row] for row in table.rows]


def column(table, name: str) -> list[str]:
    return [row[table.head.index(name)] for row in texts(table)]


def test_several_runs_are_told_by_median_and_quartiles() -> None:
    (table,) = summary_tables(result_of(FIVE), styles(result_of(FIVE)))
    assert column(table, "Mean distance, m") == ["3.000 (2.000–4.000)"]
    assert column(table, "Runs") == ["5"] and column(table, "Settled") == ["4 of 5"]
    assert column(table, "Settled at, s") == ["12.5 (11.8–13.2)"]
    assert column(table, "Contacts") == ["2 of 5"] and column(table, "Clearance, m") == ["−0.004"]
    assert column(table, "Path, m") == column(table, "Stuck robots") == [NOTHING]
    assert "quartiles" in table.notes[0]


def test_a_single_run_is_told_as_it_is() -> None:
    result = result_of([entry(final=2.345678, settled_at_s=12.34, contacts=3, stuck_robots=1)])
    (table,) = summary_tables(result, styles(result))
    assert column(table, "Mean distance, m") == ["2.346"] and column(table, "Settled") == ["yes"]
    assert column(table, "Contacts") == ["3"] and column(table, "Stuck robots") == ["1"]
    assert not table.notes
    assert runs_table(result, styles(result)) is None


def test_what_is_zero_but_for_rounding_has_no_sign() -> None:
    result = result_of([entry(min_clearance_m=-0.0004)])
    (table,) = summary_tables(result, styles(result))
    assert column(table, "Clearance, m") == ["0.000"]


def test_every_map_has_a_table_and_metres_of_different_maps_no_common_median() -> None:
    result = result_of([*FIVE, *(entry("rapf", k, 9.0, map_name="museum") for k in range(5))])
    tables = summary_tables(result, styles(result))
    assert [table.caption for table in tables] == ["All maps and teams together", "rooms", "museum"]
    assert "Mean distance, m" not in tables[0].head and len(tables[0].head) == len(tables[0].rows[0])
    assert column(tables[0], "Mean distance / median") == ["1.000 (1.000–1.000)"]
    assert column(tables[2], "Mean distance, m") == ["9.000 (9.000–9.000)"]


def test_every_run_has_a_row_as_long_as_they_are_few() -> None:
    result = result_of(FIVE)
    table = runs_table(result, styles(result))
    assert table is not None and column(table, "Seed") == list("01234")
    assert column(table, "Settled at, s")[0] == "no"
    many = result_of([entry(seed=k) for k in range(MOST_ROWS + 1)])
    assert runs_table(many, styles(many)) is None


def test_the_mean_time_is_told_where_it_is_known() -> None:
    result = result_of([entry(seed=k, mean_time_s=2.0 + k) for k in range(3)])
    (summary,), runs = summary_tables(result, styles(result)), runs_table(result, styles(result))
    assert column(summary, "Mean time, s") == ["3.000 (2.500–3.500)"]
    assert runs is not None and column(runs, "Mean time, s") == ["2.000", "3.000", "4.000"]
    without = result_of(FIVE)
    assert "Mean time, s" not in summary_tables(without, styles(without))[0].head


def test_gains_are_told_by_set_or_between_which_values_they_are() -> None:
    few = result_of([entry(gains=(("k_rep", 0.3),)), entry(gains=(("k_rep", 1.0),))], units={"k_rep": "N m³"})
    table = controllers_table(few, styles(few))
    assert texts(table) == [["RAPF A", "rapf", "k_rep 0.3 N m³"], ["RAPF B", "rapf", "k_rep 1 N m³"]]
    assert gains_table(few, styles(few)) is None
    many = result_of(
        [
            entry(gains=(("k_rep", 0.1 * k), ("limit", None if k == 3 else 2.0), ("nu", 1.0)))
            for k in range(1, 20)
        ],
        units={"k_rep": "N m³"},
    )
    table = controllers_table(many, styles(many))
    assert texts(table) == [["RAPF", "rapf", "k_rep 0.1 to 1.9 N m³, limit 2 or none, nu 1"]]
    listed = gains_table(many, styles(many))
    assert listed is not None and len(listed.rows) == 19


def test_a_controller_all_of_whose_runs_failed_is_named() -> None:
    result = result_of([entry(), entry("mine", error="no")])
    assert column(controllers_table(result, styles(result)), "Controller") == ["RAPF", "mine"]


def test_failures_are_listed_up_to_some() -> None:
    failed = [entry("mine", k, error=f"<b>error {k}</b>", gains=(("k", 1.0),)) for k in range(MOST_ROWS + 3)]
    result = result_of([entry(), *failed])
    table = failures_table(result, styles(result))
    assert table is not None and len(table.rows) == MOST_ROWS
    assert texts(table)[2] == ["mine", "rooms", "spread, 2", "k 1", "<b>error 2</b>"]
    assert table.notes == ("3 more failed runs in results.csv.",)
    assert failures_table(result_of([entry()]), {}) is None


def test_pairs_have_intervals_where_there_are_several() -> None:
    entries = [
        entry(name, k, base + 0.1 * k) for k in range(8) for name, base in (("rapf", 1.0), ("rpf", 2.0))
    ]
    result = result_of(entries)
    found = comparisons(result)
    table = pairs_table(found, styles(result))
    assert column(table, "Pairs") == ["8"] and column(table, "First is lower, %") == ["100 (100 to 100)"]
    ratio = found[0].paired.ratio
    assert column(table, "Median ratio") == [f"{ratio.estimate:.3f} ({ratio.low:.3f} to {ratio.high:.3f})"]
    assert column(table, "Median difference, m") == ["−1.000 (−1.000 to −1.000)"]
    assert "draw whole pairs" in pairs_words(result, found)
    one = result_of(entries[:2])
    table = pairs_table(comparisons(one), styles(one))
    assert table.head == ("First", "Second", "Ratio", "Difference, m")
    assert "one pair only" in pairs_words(one, comparisons(one))


def test_words_on_pairs_say_what_was_drawn_and_chosen() -> None:
    entries = [
        entry(name, k, 1.0 + level, map_name=f"m{m}", gains=(("k", level),))
        for m in range(CLUSTERS)
        for k in range(2)
        for level in (0.1, 0.2, 0.3)
        for name in ("rapf", "rpf")
    ]
    result = result_of(entries)
    words = pairs_words(result, comparisons(result))
    assert "draw whole maps" in words and "lowest median take part" in words
    assert "each with its best gains" in lede(result, comparisons(result))


@pytest.mark.parametrize(
    ("result", "title", "words"),
    [
        (
            result_of([entry(final=2.0, settled_at_s=8.04)], kind="run"),
            "RAPF on rooms",
            "At the end the nearest robot is 2.000 m away on average; settled after 8.0 s.",
        ),
        (
            result_of([entry(final=3.0), entry("rpf", final=2.0)], kind="comparison"),
            "RAPF, RPF on rooms",
            "Final mean distance to the nearest robot: RPF 2.000 m, RAPF 3.000 m (+50 %).",
        ),
        (result_of([entry(final=None)], kind="run"), "RAPF on rooms", "No run has a result."),
        (result_of([entry(final=2.0)]), "Sweep study", "1 run, median final distance 2.000 m."),
    ],
)
def test_the_first_words(result, title, words) -> None:
    assert title_of(result) == title
    assert lede(result, comparisons(result)) == words


def test_what_is_missing_or_failed_is_said_first() -> None:
    assert gaps(result_of(FIVE)) == []
    assert gaps(result_of(FIVE, wanted=6)) == ["Not finished: 1 of 6 runs is missing."]
    both = result_of([*FIVE, entry("rpf", error="no")], wanted=20)
    assert gaps(both) == ["Not finished: 14 of 20 runs are missing.", "1 of 6 runs failed."]
    assert dict(facts(both))["Runs"] == "5 done, 1 failed, 14 of 20 missing"


def test_what_did_not_go_well_is_counted() -> None:
    assert troubles(result_of(FIVE)) == [
        "In 2 of 5 runs a robot touched a wall or another one.",
        "In 1 of 5 runs the team had not settled by the end.",
    ]
    assert troubles(result_of([entry(settled_at_s=1.0, stuck_robots=1)])) == ["A robot was stuck at the end."]
    assert troubles(result_of([entry(settled_at_s=1.0)])) == []
    assert troubles(result_of([entry(error="no")])) == []


def test_facts_are_complete_and_short() -> None:
    result = result_of([entry(seed=k, robots=n) for k in range(30) for n in (4, 6)])
    result.facts["team"] = {
        "max_speed_m_per_s": 1.0,
        "communication_range_m": None,
        "robots": 4,
        "mass_kg": [1, 2],
    }
    result.facts["versions"] = {"python": "3.11.7", "robocov": "0.1.0"}
    told = dict(facts(result))
    assert told["Seeds"] == "0 to 29" and told["Robots"] == "4, 6" and told["Duration"] == "6 s"
    assert told["Team"] == "max speed 1 m/s, communication range without limit, mass 1 to 2 kg"
    assert told["Versions"] == "python 3.11.7, robocov 0.1.0" and told["Control period"] == "100 ms"
    odd = dict(facts(result_of([entry(seed=k * k) for k in range(20)])))
    assert odd["Seeds"].endswith("121, … (20)")


def test_runs_are_called_by_what_tells_them_apart() -> None:
    several = [entry("rapf", k, start=s) for k in range(2) for s in ("corner", "spread")]
    result = result_of(several)
    assert run_title(result, several[0], "RAPF") == "RAPF · corner · seed\u00a00"
    assert run_title(result_of([entry()], kind="run"), entry(), "RAPF") == "RAPF · rooms"
    one = entry(gains=(("k", 1.0),), settled_at_s=3.0, path_length_m=1.5)
    assert run_facts(result, one) == "Gains: k 1; settled at 3.0 s; 0 contacts; 1.50 m of path per robot."
    assert counted(1, "contact") in run_facts(result, entry(contacts=1))
    assert np.isnan(entry(error="no").final)
