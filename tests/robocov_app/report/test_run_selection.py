"""Selection of the runs that a page shows."""

from collections.abc import Iterable

from hypothesis import given
from hypothesis import strategies as st
from reported_results import build_result, build_run

from robocov_app.report.analysis.selection import MAX_SHOWN_RUNS, RunSelection, select_runs
from robocov_app.report.results.result import ReportedResult, ReportedRun

CONTROLLERS = ("rapf", "rpf", "lloyd")
MAP_NUMBERS = range(4)
MANY_RUNS = st.lists(
    st.builds(
        lambda controller, map_number, final, seed: build_run(
            controller, seed, final, map_name=f"m{map_number}"
        ),
        st.sampled_from(CONTROLLERS),
        st.sampled_from(MAP_NUMBERS),
        st.floats(0.5, 9.0),
        st.integers(0, 60),
    ),
    min_size=1,
    max_size=150,
    unique_by=lambda run: (run.controller, run.map, run.seed),
)


def find_range(runs: Iterable[ReportedRun]) -> tuple[float, float]:
    """Return the lowest and the highest final mean distance."""
    distances = [run.final_distance for run in runs]
    return min(distances), max(distances)


def list_pane_runs(selection: RunSelection) -> list[ReportedRun]:
    """Return the runs that are side by side at first."""
    return [selection.runs[pane] for pane in selection.panes]


def build_paired_result(maps: int, seeds: int) -> ReportedResult:
    """Return a result with a run of each controller for each map and seed."""
    runs = []
    for map_number in range(maps):
        for seed in range(seeds):
            for controller in CONTROLLERS:
                final = 1.0 + 0.37 * seed % 2.0 + (controller == "rpf")
                runs.append(build_run(controller, seed, final, map_name=f"m{map_number}"))
    return build_result(runs)


@given(MANY_RUNS)
def test_a_selection_is_small_and_contains_the_extremes_of_each_map(runs: list[ReportedRun]) -> None:
    selection = select_runs(build_result(runs))
    assert len(set(selection.runs)) == len(selection.runs) <= MAX_SHOWN_RUNS
    assert [run for run in runs if run in selection.runs] == list(selection.runs)
    assert 1 <= len(selection.panes) <= 4
    assert len(set(selection.panes)) == len(selection.panes)
    assert max(selection.panes) < len(selection.runs)
    if len(runs) <= MAX_SHOWN_RUNS:
        assert selection.runs == tuple(runs)
        assert selection.note == "All runs."
        assert selection.roles == {}
        return
    assert set(selection.roles) == set(selection.runs)
    for controller in CONTROLLERS:
        for map_number in MAP_NUMBERS:
            group = [run for run in runs if (run.controller, run.map) == (controller, f"m{map_number}")]
            if group:
                selected = [run for run in selection.runs if run in group]
                assert find_range(selected) == find_range(group)
                best = min(group, key=lambda run: run.final_distance)
                worst = max(group, key=lambda run: run.final_distance)
                assert selection.roles[best] == "best"
                assert best is worst or selection.roles[worst] == "worst"


def test_panes_show_runs_from_the_same_start() -> None:
    result = build_paired_result(maps=2, seeds=20)
    selection = select_runs(result)
    pane_runs = list_pane_runs(selection)
    assert [run.controller for run in pane_runs] == list(CONTROLLERS)
    assert len({run.case for run in pane_runs}) == 1
    assert selection.note.startswith(f"{len(selection.runs)} of 120 runs: for each map, the best")
    for controller in CONTROLLERS:
        selected = [run for run in selection.runs if run.controller == controller]
        group = [run for run in result.runs if run.controller == controller]
        assert find_range(selected) == find_range(group)


def test_the_middle_case_is_one_that_most_groups_have() -> None:
    rapf_runs = [build_run("rapf", seed, 1.0 + seed) for seed in range(5)]
    result = build_result([*rapf_runs, build_run("rpf", 0, 3.0), build_run("rpf", 4, 2.0)])
    pane_runs = list_pane_runs(select_runs(result))
    assert len(pane_runs) == 2
    assert len({run.seed for run in pane_runs}) == 1


def test_with_very_many_maps_the_extremes_of_all_maps_are_selected() -> None:
    result = build_paired_result(maps=40, seeds=3)
    selection = select_runs(result)
    # The lowest, the highest and a middle cost of each controller.
    assert len(selection.runs) <= 3 * len(CONTROLLERS)
    for controller in CONTROLLERS:
        selected = [run for run in selection.runs if run.controller == controller]
        group = [run for run in result.runs if run.controller == controller]
        assert find_range(selected) == find_range(group)
    assert selection.note.startswith(f"{len(selection.runs)} of 360 runs: over all maps, the best")


def test_a_few_sets_of_gains_of_one_controller_are_side_by_side() -> None:
    runs = [build_run(seed=seed, gains=(("k", value),)) for seed in range(2) for value in (1.0, 2.0, 3.0)]
    selection = select_runs(build_result(runs))
    assert [dict(run.gains)["k"] for run in list_pane_runs(selection)] == [1.0, 2.0, 3.0]


def test_runs_without_a_cost_are_selected_as_well() -> None:
    selection = select_runs(build_result([build_run(final=None), build_run("rpf", final=None)]))
    assert len(selection.runs) == 2
    assert selection.panes == (0,)


def test_failed_runs_are_not_selected() -> None:
    selection = select_runs(build_result([build_run(error="no")]))
    assert selection.runs == ()
    assert selection.panes == ()


def test_the_first_of_many_runs_without_a_cost_are_selected() -> None:
    result = build_result([build_run(seed=seed, final=None) for seed in range(MAX_SHOWN_RUNS + 5)])
    selection = select_runs(result)
    assert selection.runs == result.runs[:MAX_SHOWN_RUNS]
    assert selection.panes == (0,)
    expected = f"The first {MAX_SHOWN_RUNS} of {MAX_SHOWN_RUNS + 5} runs: none has a final cost."
    assert selection.note == expected
