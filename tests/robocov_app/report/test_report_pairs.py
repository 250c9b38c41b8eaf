"""Controllers compared pair by pair."""

import numpy as np
import pytest
from reported_results import entry, result_of

from robocov_app.figures.statistics import bootstrap, mean_with_t_interval
from robocov_app.report.document import load_template
from robocov_app.report.groups import compared_groups, comparisons


def method(comparisons, chosen):
    return load_template("pairs.jinja").module.method(comparisons, chosen)


def found(entries):
    return comparisons(compared_groups(result_of(entries))[0])


def maps_of(ratios: dict[str, float], seeds: int = 4, noise: float = 0.01):
    """Return runs of two controllers whose ratio depends on the map."""
    rng = np.random.default_rng(7)
    return [
        entry(name, seed, 2.0 * factor * float(np.exp(rng.normal(0.0, noise))), map_name=map_name)
        for map_name, ratio in ratios.items()
        for seed in range(seeds)
        for name, factor in (("rapf", ratio), ("rpf", 1.0))
    ]


def test_pairs_share_map_team_start_and_seed() -> None:
    entries = [
        entry("rapf", 0, 1.0),
        entry("rpf", 0, 2.0),
        entry("rapf", 1, 1.0),
        entry("rpf", 1, 2.0, start="corner"),
        entry("rapf", 2, 1.0, robots=5),
        entry("rpf", 2, 2.0),
        entry("rapf", 3, 3.0, map_name="museum"),
        entry("rpf", 3, 2.0, map_name="museum"),
        entry("rpf", 4, None),
        entry("rapf", 4, 1.0),
        entry("rapf", 5, 1.0, team=(("max_speed", 1.0),)),
        entry("rpf", 5, 1.0, team=(("max_speed", 2.0),)),
    ]
    (comparison,) = found(entries)
    assert [(each.name, each.a.tolist(), each.b.tolist()) for each in comparison.maps] == [
        ("rooms", [1.0], [2.0]),
        ("museum", [3.0], [2.0]),
    ]
    assert comparison.pairs == 2 and comparison.alone == 7
    assert "7 runs without a counterpart" in method([comparison], "")


def test_there_is_no_comparison_without_pairs() -> None:
    assert found([entry("rapf", 0), entry("rpf", 1)]) == []
    assert found([entry("rapf", 0)]) == found([entry(error="no")]) == []


def test_the_headline_does_not_hide_that_maps_disagree() -> None:
    ratios = {"a": 0.8, "b": 0.85, "museum": 1.3, "c": 1.0, "d": 0.7}
    (comparison,) = found(maps_of(ratios))
    for each in comparison.maps:
        assert each.ratio.estimate == pytest.approx(ratios[each.name], rel=0.03)
    said = comparison.headline()
    assert said.startswith("RAPF against RPF: better on 3 of 5 maps, worse on 1, undecided on 1; ratio 0.9")
    assert said.endswith(" over 5 maps.")
    # every map counts the same, and whole maps are drawn
    logs = [np.log(each.ratio.estimate) for each in comparison.maps]
    over = bootstrap(logs, "mean")
    assert [comparison.ratio.low, comparison.ratio.high] == pytest.approx(np.exp([over.low, over.high]))
    two = found(maps_of({"a": 0.8, "b": 1.3}))[0]
    assert two.headline().endswith("over 2 maps only.") and "2 maps are too few" in method([two], "")


def test_on_one_map_the_interval_is_over_its_seeds() -> None:
    (comparison,) = found(maps_of({"rooms": 0.8}, seeds=6))
    (own,) = comparison.maps
    wanted = mean_with_t_interval(np.log(own.a / own.b))
    assert [own.ratio.low, own.ratio.high] == pytest.approx(np.exp([wanted.low, wanted.high]))
    assert comparison.ratio == own.ratio
    assert comparison.headline().startswith("RAPF against RPF: better, ratio 0.8")
    assert comparison.headline().endswith("over 6 pairs.")


def test_teams_from_the_same_seeds_are_no_further_evidence() -> None:
    entries = maps_of({"rooms": 0.8}, noise=0.3)
    teams = [entry(e.controller, e.seed, e.final, robots=n) for e in entries for n in (4, 6, 8)]
    (few,), (many,) = found(entries), found(teams)
    assert many.pairs == 3 * few.pairs and many.ratio.low == pytest.approx(few.ratio.low)


@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_equal_pairs_and_rounding_errors_decide_nothing(ratio) -> None:
    equal = [entry(name, k, f) for k in range(8) for name, f in (("rapf", 2.0 * ratio), ("rpf", 2.0))]
    (comparison,) = found(equal)
    assert comparison.maps[0].verdict == "undecided"
    near = [entry("rapf", k, 2.0 - 1e-9 * k - 1e-7) for k in range(8)]
    (comparison,) = found([*near, *(entry("rpf", k, 2.0) for k in range(8))])
    assert comparison.maps[0].verdict == "undecided" and comparison.ratio.high < 1.0


def test_many_groups_are_compared_with_the_first() -> None:
    names = ["rapf", "rpf", "lloyd", "a", "b", "c"]
    many = found([entry(name, 0, 1.0 + k) for k, name in enumerate(names)])
    assert [(each.first.controller, each.second.controller) for each in many] == [
        ("rapf", name) for name in names[1:]
    ]
    assert len(found([entry(name, 0, 1.0 + k) for k, name in enumerate(names[:4])])) == 6


@pytest.mark.parametrize("maps", [1, 6])
def test_gains_are_not_compared_on_the_runs_that_they_were_chosen_on(maps) -> None:
    # two equal controllers; of one there are many gains, all of them alike: the best of these is luck
    rng = np.random.default_rng(3)
    effects = []
    for _ in range(40):
        entries = [
            entry(name, seed, float(rng.lognormal()), map_name=f"m{m}", gains=(("k", float(k)),))
            for m in range(maps)
            for seed in range(6)
            for name, count in (("rapf", 12), ("rpf", 1))
            for k in range(count)
        ]
        (comparison,) = found(entries)
        effects.append(np.log(comparison.ratio.estimate))
    # chosen on these same runs it is about -.49 and -.18
    assert abs(np.mean(effects)) < 3.0 * np.std(effects) / np.sqrt(len(effects))


def test_which_gains_were_chosen_is_told_and_failed_runs_count_as_the_worst() -> None:
    entries = []
    for m in range(3):
        for seed in range(3):
            failed = seed < 2
            gains = ((1.0, 1.0, failed), (2.0, 1.5, False), (3.0, 4.0, False))
            entries += [
                entry("rapf", seed, cost, map_name=f"m{m}", gains=(("k", k),), error="no" if bad else None)
                for k, cost, bad in gains
            ]
            entries.append(entry("rpf", seed, 2.0, map_name=f"m{m}"))
    groups, words = compared_groups(result_of(entries))
    assert [group.label for group in groups] == ["RAPF (tuned)", "RPF"]
    assert {dict(each.gains)["k"] for each in groups[0].entries} == {2.0}
    assert "on the other maps" in words and "Chosen: RAPF k 2 in 3 of 3." in words
    one = [each for each in entries if each.map == "m0"]
    assert "lowest median from the others" in compared_groups(result_of(one))[1]
    _, words = compared_groups(result_of([each for each in one if each.seed == 2]))
    assert "too few to choose gains fairly" in words


def test_gains_of_a_single_controller_are_compared_each_by_itself() -> None:
    entries = [
        entry(seed=s, final=1.0 + k + 0.1 * s, gains=(("k", k),)) for s in range(3) for k in (1.0, 2.0)
    ]
    groups, words = compared_groups(result_of(entries))
    assert [group.label for group in groups] == ["RAPF k 1", "RAPF k 2"] and "none was chosen" in words
