"""Which runs a page shows."""

from hypothesis import given
from hypothesis import strategies as st
from reported_results import entry, result_of

from robocov_app.report.groups import MOST_RUNS, chosen

MANY = st.lists(
    st.tuples(
        st.sampled_from(["rapf", "rpf", "lloyd"]), st.integers(0, 3), st.floats(0.5, 9.0), st.integers(0, 60)
    ),
    min_size=1,
    max_size=150,
    unique_by=lambda each: (each[0], each[1], each[3]),
)


def made(rows):
    return result_of(
        [entry(controller, seed, final, map_name=f"m{k}") for controller, k, final, seed in rows]
    )


@given(MANY)
def test_what_is_shown_is_little_and_holds_the_extremes(rows) -> None:
    result = made(rows)
    choice = chosen(result)
    assert len(set(choice.entries)) == len(choice.entries) <= MOST_RUNS
    assert [each for each in result.entries if each in choice.entries] == list(choice.entries)
    assert choice.panes and len(choice.panes) <= 4
    assert len(set(choice.panes)) == len(choice.panes) and max(choice.panes) < len(choice.entries)
    if len(rows) <= MOST_RUNS:
        assert choice.entries == result.entries and choice.words == "All runs."
        return
    for controller in {row[0] for row in rows}:
        for k in {row[1] for row in rows}:
            own = [e for e in result.entries if e.controller == controller and e.map == f"m{k}"]
            if own:
                finals = [e.final for e in choice.entries if e in own]
                assert min(e.final for e in own) in finals and max(e.final for e in own) in finals


def paired_runs(maps: int, seeds: int):
    return [
        (controller, k, 1.0 + 0.37 * seed % 2.0 + (controller == "rpf"), seed)
        for k in range(maps)
        for seed in range(seeds)
        for controller in ("rapf", "rpf", "lloyd")
    ]


def test_what_stands_side_by_side_has_the_same_starts() -> None:
    choice = chosen(made(paired_runs(2, 20)))
    shown = [choice.entries[k] for k in choice.panes]
    assert [each.controller for each in shown] == ["rapf", "rpf", "lloyd"]
    assert len({each.case for each in shown}) == 1
    assert choice.words.startswith(f"{len(choice.entries)} of 120 runs: on each map")
    for controller in ("rapf", "rpf", "lloyd"):
        shown, every = (
            [each.final for each in entries if each.controller == controller]
            for entries in (choice.entries, made(paired_runs(2, 20)).fine)
        )
        assert (min(shown), max(shown)) == (min(every), max(every))


def test_the_case_in_the_middle_is_one_that_most_have() -> None:
    runs = [entry("rapf", seed, 1.0 + seed) for seed in range(5)]
    result = result_of([*runs, entry("rpf", 0, 3.0), entry("rpf", 4, 2.0)])
    assert len({result.fine[k].seed for k in chosen(result).panes}) == 1
    assert len(chosen(result).panes) == 2


def test_of_very_many_maps_the_extremes_of_all_are_shown() -> None:
    choice = chosen(made(paired_runs(40, 3)))
    assert len(choice.entries) <= 9
    assert "over all maps" in choice.words and choice.words.startswith(f"{len(choice.entries)} of 360 runs")


def test_few_gains_of_one_controller_stand_side_by_side() -> None:
    entries = [entry(seed=seed, gains=(("k", k),)) for seed in range(2) for k in (1.0, 2.0, 3.0)]
    choice = chosen(result_of(entries))
    assert [dict(choice.entries[k].gains)["k"] for k in choice.panes] == [1.0, 2.0, 3.0]


def test_runs_without_a_cost_are_shown_as_well() -> None:
    choice = chosen(result_of([entry(final=None), entry("rpf", final=None)]))
    assert len(choice.entries) == 2 and choice.panes == (0,)
    nothing = chosen(result_of([entry(error="no")]))
    assert nothing.entries == () and nothing.panes == ()


def test_of_many_runs_without_a_cost_the_first_are_shown() -> None:
    result = result_of([entry(seed=k, final=None) for k in range(MOST_RUNS + 5)])
    choice = chosen(result)
    assert choice.entries == result.entries[:MOST_RUNS] and choice.panes == (0,)
    assert choice.words == f"The first {MOST_RUNS} of {MOST_RUNS + 5} runs: none has a final cost."
