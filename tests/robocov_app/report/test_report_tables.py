"""The tables of a report, and what it says in words."""

from dataclasses import replace

import numpy as np
import pytest
from reported_results import entry, result_of

from robocov.errors import format_count
from robocov_app.report.facts import facts, gaps, lede, meanings, run_facts, run_title, title_of, troubles
from robocov_app.report.groups import compared_groups, comparisons, styles
from robocov_app.report.results import Damaged, Reference
from robocov_app.report.tables import (
    MOST_ROWS,
    NOTHING,
    controllers_table,
    failures_table,
    gains_table,
    map_pairs_tables,
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
    return [list(row) for row in table.rows]


def column(table, name: str) -> list[str]:
    return [row[table.head.index(name)] for row in texts(table)]


def test_several_runs_are_told_by_median_and_quartiles() -> None:
    (table,) = summary_tables(result_of(FIVE))
    assert column(table, "Mean distance, m") == ["3.000 (2.000–4.000)"]
    assert column(table, "Runs") == ["5"] and column(table, "Settled") == ["4 of 5"]
    assert column(table, "Settled at, s") == ["12.5 (11.8–13.2)"]
    assert column(table, "Contacts") == ["2 of 5"] and column(table, "Clearance, m") == ["−0.004"]
    assert column(table, "Path, m") == column(table, "Stuck robots") == [NOTHING]
    assert "quartiles" in table.notes[0]


def test_a_single_run_is_told_as_it_is() -> None:
    result = result_of([entry(final=2.345678, settled_at_s=12.34, contacts=3, stuck_robots=1)])
    (table,) = summary_tables(result)
    assert column(table, "Mean distance, m") == ["2.346"] and column(table, "Settled") == ["yes"]
    assert column(table, "Contacts") == ["3"] and column(table, "Stuck robots") == ["1"]
    assert not table.notes
    assert runs_table(result) is None


def test_what_is_zero_but_for_rounding_has_no_sign() -> None:
    result = result_of([entry(min_clearance_m=-0.0004)])
    (table,) = summary_tables(result)
    assert column(table, "Clearance, m") == ["0.000"]


def test_every_map_has_a_table_and_meters_of_different_maps_no_common_median() -> None:
    result = result_of([*FIVE, *(entry("rapf", k, 9.0, map_name="museum") for k in range(5))])
    tables = summary_tables(result)
    assert [table.caption for table in tables] == ["All maps and teams together", "rooms", "museum"]
    assert "Mean distance, m" not in tables[0].head and len(tables[0].head) == len(tables[0].rows[0])
    assert column(tables[0], "Mean distance / median") == ["1.000 (1.000–1.000)"]
    assert column(tables[2], "Mean distance, m") == ["9.000 (9.000–9.000)"]


def test_every_run_has_a_row_as_long_as_they_are_few() -> None:
    result = result_of(FIVE)
    table = runs_table(result)
    assert table is not None and column(table, "Seed") == list("01234")
    assert column(table, "Settled at, s")[0] == "no"
    many = result_of([entry(seed=k) for k in range(MOST_ROWS + 1)])
    assert runs_table(many) is None


def test_the_mean_time_is_told_where_it_is_known() -> None:
    result = result_of([entry(seed=k, mean_time_s=2.0 + k) for k in range(3)])
    (summary,), runs = summary_tables(result), runs_table(result)
    assert column(summary, "Mean time, s") == ["3.000 (2.500–3.500)"]
    assert runs is not None and column(runs, "Mean time, s") == ["2.000", "3.000", "4.000"]
    without = result_of(FIVE)
    assert "Mean time, s" not in summary_tables(without)[0].head


def test_gains_are_told_by_set_or_between_which_values_they_are() -> None:
    few = result_of([entry(gains=(("k_rep", 0.3),)), entry(gains=(("k_rep", 1.0),))], units={"k_rep": "N m³"})
    few = replace(few, meanings={"k_rep": "strength", "k_att": "of others"})
    table = controllers_table(few)
    assert texts(table) == [
        ["RAPF k_rep 0.3", "rapf", "k_rep 0.3 N m³"],
        ["RAPF k_rep 1", "rapf", "k_rep 1 N m³"],
    ]
    marks = [styles(few)[row[0]].mark for row in table.rows]
    assert len(set(marks)) == 2 and meanings(few) == [("k_rep", "strength")]
    assert gains_table(few) is None
    many = result_of(
        [
            entry(gains=(("k_rep", 0.1 * k), ("limit", None if k == 3 else 2.0), ("nu", 1.0)))
            for k in range(1, 20)
        ],
        units={"k_rep": "N m³"},
    )
    table = controllers_table(many)
    assert texts(table) == [["RAPF", "rapf", "k_rep 0.1 to 1.9 N m³, limit 2 or none, nu 1"]]
    listed = gains_table(many)
    assert listed is not None and len(listed.rows) == 19


def test_a_controller_all_of_whose_runs_failed_is_named() -> None:
    result = result_of([entry(), entry("mine", error="no")])
    assert column(controllers_table(result), "Controller") == ["RAPF", "mine"]


def test_failures_are_listed_up_to_some() -> None:
    failed = [entry("mine", k, error=f"<b>error {k}</b>", gains=(("k", 1.0),)) for k in range(MOST_ROWS + 3)]
    result = result_of([entry(), *failed])
    table = failures_table(result)
    assert table is not None and len(table.rows) == MOST_ROWS
    assert texts(table)[2] == ["mine", "rooms", "spread, 2", "k 1", "<b>error 2</b>"]
    assert table.notes == ("3 more runs.",)
    assert failures_table(result_of([entry()])) is None
    damaged = replace(result_of([entry()]), damaged=(Damaged("rooms-0", "record.npz: no zip file"),))
    table = failures_table(damaged)
    assert table is not None and texts(table) == [["rooms-0", *[NOTHING] * 3, "record.npz: no zip file"]]


def test_pairs_are_told_over_maps_and_map_by_map() -> None:
    entries = [
        entry(name, k, base * (1.0 + 0.01 * k * (name == "rapf")), map_name=f"m{m}")
        for m in range(2)
        for k in range(8)
        for name, base in (("rapf", 1.0 + 2.0 * m), ("rpf", 2.0))
    ]
    result = result_of(entries)
    found = comparisons(compared_groups(result)[0])
    table = pairs_table(found)
    assert column(table, "First is") == ["better on 1 of 2 maps, worse on 1"]
    assert column(table, "First is lower in") == ["8 of 16"]
    ratio = found[0].ratio
    assert column(table, "Ratio") == [f"{ratio.estimate:.3f} ({ratio.low:.3f} to {ratio.high:.3f})"]
    (by_map,) = map_pairs_tables(found)
    assert column(by_map, "Map") == ["m0", "m1"] and column(by_map, "First is") == ["better", "worse"]
    assert column(by_map, "First, m") == ["1.035", "3.105"] and column(by_map, "Pairs") == ["8", "8"]
    one = comparisons(compared_groups(result_of(entries[:2]))[0])
    assert column(pairs_table(one), "First is") == ["one pair only"]
    assert map_pairs_tables(one) == []


def test_how_far_runs_stay_above_the_reference_is_told_where_it_is_known() -> None:
    entries = [entry("rapf", k, 2.0 + 0.1 * k) for k in range(3)]
    entries += [entry("rapf", 9, 2.0, uncovered_area_m2=3.0), entry("rapf", final=5.0, map_name="museum")]
    result = replace(result_of(entries), references={entries[0].setting: Reference(2.0, 0.0)})
    every, rooms, museum = summary_tables(result)
    name = "Above J_ref, %"
    # another part of the map is covered at seed 9: its cost is none of the same places
    assert column(rooms, name) == column(every, name) == ["5.0 (2.5–7.5)"] and column(museum, name) == [
        NOTHING
    ]
    assert "J/J_ref − 1" in every.notes[-1]
    alone = replace(result_of(entries[2:3], kind="run"), references=result.references)
    assert ", 10.0 % above the best placement known" in lede(alone, [])[0]


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
    assert lede(result, comparisons(compared_groups(result)[0])) == [words]


def test_what_is_missing_or_failed_is_said_first() -> None:
    assert gaps(result_of(FIVE)) == []
    assert gaps(result_of(FIVE, wanted=6)) == ["Not finished: 1 of 6 runs is missing."]
    failed = [entry("rpf", seed=k, error=words) for k, words in enumerate(("no", "no", "a", "b", "c"))]
    both = replace(result_of([*FIVE, *failed], wanted=20), damaged=(Damaged("run-7", "no zip file"),))
    assert gaps(both) == [
        "5 of 10 runs failed (RPF 5 of 5): no; a; b; and 1 more.",
        "1 run cannot be read and is left out: run-7 (no zip file).",
        "Not finished: 9 of 20 runs are missing.",
    ]
    assert dict(facts(both))["Runs"] == "5 done, 5 failed, 1 unreadable, 9 of 20 missing"


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
    assert format_count(1, "contact") in run_facts(result, entry(contacts=1))
    assert np.isnan(entry(error="no").final)
