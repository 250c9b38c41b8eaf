"""Tables of a report."""

from dataclasses import replace

import pytest
from reported_results import build_result, build_run

from robocov_app.report.analysis.comparisons import GroupComparison, compare_groups
from robocov_app.report.analysis.groups import choose_group_styles
from robocov_app.report.analysis.tuning import choose_compared_groups
from robocov_app.report.results.result import DamagedRun, Reference, ReportedRun
from robocov_app.report.tables.controllers import build_controllers_table, build_gain_sets_table
from robocov_app.report.tables.failures import MAX_FAILURE_ROWS, build_failures_table
from robocov_app.report.tables.pairs import build_map_pairs_tables, build_pairs_table
from robocov_app.report.tables.summaries import (
    MAX_RUN_ROWS,
    MAX_SETTINGS,
    build_runs_table,
    build_summary_tables,
)
from robocov_app.report.tables.table import NO_VALUE, PageTable


def build_five_runs() -> list[ReportedRun]:
    """Return runs with final distances of 1 to 5 m, the first of which did not settle."""
    runs = []
    for seed in range(5):
        run = build_run(
            "rapf",
            seed,
            1.0 + seed,
            settled_at_s=None if seed == 0 else 10.0 + seed,
            contacts=seed % 2,
            min_clearance_m=-0.001 * seed,
        )
        runs.append(run)
    return runs


def get_column(table: PageTable | None, heading: str) -> list[str]:
    """Return the cells of a column."""
    assert table is not None
    column = table.head.index(heading)
    return [row[column] for row in table.rows]


def compare(runs: list[ReportedRun]) -> list[GroupComparison]:
    """Compare the controllers of some runs."""
    return compare_groups(choose_compared_groups(build_result(runs)).groups)


def test_several_runs_have_their_median_and_quartiles() -> None:
    (table,) = build_summary_tables(build_result(build_five_runs()))
    assert get_column(table, "Mean distance, m") == ["3.000 (2.000–4.000)"]
    assert get_column(table, "Runs") == ["5"]
    assert get_column(table, "Settled") == ["4 of 5"]
    assert get_column(table, "Settled at, s (settled runs)") == ["12.5 (11.8–13.2)"]
    assert get_column(table, "Contacts") == ["2 of 5 runs"]
    assert get_column(table, "Clearance, m") == ["−0.004"]
    assert get_column(table, "Path, m") == [NO_VALUE]
    assert get_column(table, "Stuck robots") == [NO_VALUE]
    assert "quartiles" in table.notes[0]


def test_a_single_run_has_its_values() -> None:
    run = build_run(final=2.345678, settled_at_s=12.34, contacts=3, stuck_robots=1)
    result = build_result([run])
    (table,) = build_summary_tables(result)
    assert get_column(table, "Mean distance, m") == ["2.346"]
    assert get_column(table, "Settled") == ["yes"]
    assert get_column(table, "Contacts") == ["3"]
    assert get_column(table, "Stuck robots") == ["1"]
    assert not table.notes
    assert build_runs_table(result) is None


def test_a_clearance_rounded_to_zero_has_no_sign() -> None:
    (table,) = build_summary_tables(build_result([build_run(min_clearance_m=-0.0004)]))
    assert get_column(table, "Clearance, m") == ["0.000"]


def test_every_map_has_a_table_and_the_table_of_all_maps_has_scaled_distances() -> None:
    museum_runs = [build_run("rapf", seed, 9.0, map_name="museum") for seed in range(5)]
    tables = build_summary_tables(build_result([*build_five_runs(), *museum_runs]))
    all_maps, rooms, museum = tables
    assert all_maps.caption == "All maps and teams together"
    assert (rooms.caption, museum.caption) == ("rooms", "museum")
    assert "Mean distance, m" not in all_maps.head
    assert len(all_maps.head) == len(all_maps.rows[0])
    assert get_column(all_maps, "Mean distance / median") == ["1.000 (1.000–1.000)"]
    assert get_column(museum, "Mean distance, m") == ["9.000 (9.000–9.000)"]


def test_the_table_of_too_many_maps_explains_its_columns() -> None:
    runs = []
    for number in range(MAX_SETTINGS + 1):
        runs += [build_run("rapf", seed, 1.0 + seed, map_name=f"map-{number}") for seed in (0, 1)]
    (all_maps,) = build_summary_tables(build_result(runs))
    scaling_note, quartiles_note = all_maps.notes
    assert "median" in scaling_note and "quartiles" in quartiles_note


def test_every_run_has_a_row() -> None:
    table = build_runs_table(build_result(build_five_runs()))
    assert get_column(table, "Seed") == ["0", "1", "2", "3", "4"]
    assert get_column(table, "Settled at, s")[0] == "no"


def test_too_many_runs_have_no_rows_of_their_own() -> None:
    result = build_result([build_run(seed=seed) for seed in range(MAX_RUN_ROWS + 1)])
    assert build_runs_table(result) is None


def test_mean_times_are_a_column_if_they_are_known() -> None:
    result = build_result([build_run(seed=seed, mean_time_s=2.0 + seed) for seed in range(3)])
    (summary,) = build_summary_tables(result)
    assert get_column(summary, "Mean time, s") == ["3.000 (2.500–3.500)"]
    assert get_column(build_runs_table(result), "Mean time, s") == ["2.000", "3.000", "4.000"]
    (summary_without_times,) = build_summary_tables(build_result(build_five_runs()))
    assert "Mean time, s" not in summary_without_times.head


def test_variants_have_a_row_each_with_their_gains() -> None:
    runs = [build_run(gains=(("k_rep", value),)) for value in (0.3, 1.0)]
    result = build_result(runs, gain_units={"k_rep": "N m³"})
    table = build_controllers_table(result)
    assert table.rows == [
        ("RAPF k_rep 0.3", "rapf", "k_rep 0.3 N m³"),
        ("RAPF k_rep 1", "rapf", "k_rep 1 N m³"),
    ]
    styles = choose_group_styles(result)
    assert len({styles[label].mark for label in get_column(table, "Controller")}) == 2
    assert build_gain_sets_table(result) is None


def test_many_sets_of_gains_are_summarized_as_ranges_and_listed() -> None:
    runs = []
    for number in range(1, 20):
        limit = None if number == 3 else 2.0
        runs.append(build_run(gains=(("k_rep", 0.1 * number), ("limit", limit), ("nu", 1.0))))
    result = build_result(runs, gain_units={"k_rep": "N m³"})
    table = build_controllers_table(result)
    assert table.rows == [("RAPF", "rapf", "k_rep 0.1 to 1.9 N m³, limit 2 or none, nu 1")]
    assert len(get_column(build_gain_sets_table(result), "Gains")) == 19


def test_the_ends_of_a_narrow_range_of_gains_differ() -> None:
    runs = [build_run(gains=(("k_rep", 0.3 + 0.000001 * number),)) for number in range(20)]
    table = build_controllers_table(build_result(runs, gain_units={"k_rep": "N m³"}))
    assert table.rows == [("RAPF", "rapf", "k_rep 0.3 to 0.300019 N m³")]


def test_a_controller_without_successful_runs_is_listed() -> None:
    result = build_result([build_run(), build_run("mine", error="no")])
    assert get_column(build_controllers_table(result), "Controller") == ["RAPF", "mine"]


def test_failures_are_listed_up_to_a_maximum() -> None:
    failed_runs = [
        build_run("mine", seed, error=f"<b>error {seed}</b>", gains=(("k", 1.0),))
        for seed in range(MAX_FAILURE_ROWS + 3)
    ]
    table = build_failures_table(build_result([build_run(), *failed_runs]))
    assert table is not None
    assert len(table.rows) == MAX_FAILURE_ROWS
    assert table.rows[2] == ("mine", "rooms", "spread, 2", "k 1", "<b>error 2</b>")
    assert table.notes == ("3 more runs.",)


def test_damaged_runs_are_listed_by_folder() -> None:
    damaged_run = DamagedRun("rooms-0", "record.npz: no zip file")
    table = build_failures_table(replace(build_result([build_run()]), damaged_runs=(damaged_run,)))
    assert table is not None
    assert table.rows == [("rooms-0", NO_VALUE, NO_VALUE, NO_VALUE, "record.npz: no zip file")]


def test_without_failures_there_is_no_table_of_them() -> None:
    assert build_failures_table(build_result([build_run()])) is None


def test_pairs_have_a_table_of_all_maps_and_of_each_map() -> None:
    runs = []
    for map_number in range(2):
        for seed in range(8):
            rapf_distance = (1.0 + 2.0 * map_number) * (1.0 + 0.01 * seed)
            runs.append(build_run("rapf", seed, rapf_distance, map_name=f"m{map_number}"))
            runs.append(build_run("rpf", seed, 2.0, map_name=f"m{map_number}"))
    comparisons = compare(runs)
    table = build_pairs_table(comparisons)
    assert get_column(table, "First is") == ["better on 1 of 2 maps, worse on 1"]
    assert get_column(table, "First has the lower cost in") == ["8 of 16 pairs"]
    ratio = comparisons[0].ratio
    assert get_column(table, "Ratio") == [f"{ratio.estimate:.3f}"]
    (map_table,) = build_map_pairs_tables(comparisons)
    assert get_column(map_table, "Map") == ["m0", "m1"]
    assert get_column(map_table, "First is") == ["better", "worse"]
    assert get_column(map_table, "First, mean in m") == ["1.035", "3.105"]
    assert get_column(map_table, "Pairs") == ["8", "8"]


def test_a_single_pair_has_no_verdict() -> None:
    comparisons = compare([build_run("rapf"), build_run("rpf")])
    assert get_column(build_pairs_table(comparisons), "First is") == ["one pair only"]
    assert build_map_pairs_tables(comparisons) == []


def test_gaps_to_the_reference_are_a_column_if_they_are_known() -> None:
    runs = [build_run("rapf", seed, 2.0 + 0.1 * seed) for seed in range(3)]
    # This run covers another part of the map, so that its cost cannot be compared.
    runs.append(build_run("rapf", 9, 2.0, uncovered_area_m2=3.0))
    runs.append(build_run("rapf", final=5.0, map_name="museum"))
    result = replace(build_result(runs), references={runs[0].setting: Reference(2.0, 0.0)})
    all_maps, rooms, museum = build_summary_tables(result)
    heading = "Gap, %"
    assert get_column(rooms, heading) == ["5.0 (2.5–7.5)"]
    assert get_column(all_maps, heading) == ["5.0 (2.5–7.5)"]
    assert get_column(museum, heading) == [NO_VALUE]
    assert "J/J_ref − 1" in all_maps.notes[-1]


@pytest.mark.parametrize("measure", ["contacts", "stuck_robots", "min_clearance_m"])
def test_an_unknown_measure_has_no_value(measure: str) -> None:
    headings = {"contacts": "Contacts", "stuck_robots": "Stuck robots", "min_clearance_m": "Clearance, m"}
    (table,) = build_summary_tables(build_result([build_run(**{measure: None})]))
    assert get_column(table, headings[measure]) == [NO_VALUE]
