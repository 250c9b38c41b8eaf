from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov import k_median
from robocov.k_median import (
    apply_best_swap,
    apply_best_swaps,
    choose_greedily,
    improve_sources,
    move_first_source,
    rebuild_sources,
    run_lloyd,
    seed_sources,
)


def table(seed: int, sources: int = 12, targets: int = 30) -> np.ndarray:
    rng = np.random.default_rng(seed)
    places, goals = rng.uniform(0, 10, (sources, 2)), rng.uniform(0, 10, (targets, 2))
    return np.hypot(*(places - goals[:, None]).T).T * rng.uniform(0.5, 2.0, (targets, 1))


def total(distance: np.ndarray, sources: np.ndarray) -> float:
    return float(distance[:, list(sources)].min(axis=1).sum())


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 5), given_=st.integers(0, 5))
def test_placements_improve_and_keep_the_fixed_candidates(seed: int, k: int, given_: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    stays = np.arange(k) < min(given_, k)
    for step in (run_lloyd(distance, begin, stays), apply_best_swap(distance, begin, stays, 0.0)):
        assert total(distance, step) <= total(distance, begin) + 1e-9
    after = improve_sources(distance, begin, stays, 0.0)
    assert len(set(after.tolist())) == k
    assert np.array_equal(after[stays], begin[stays])
    assert total(distance, after) <= total(distance, begin) + 1e-9


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4))
def test_a_swap_is_the_best_of_all(seed: int, k: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    free = np.zeros(k, dtype=bool)
    every = [
        total(distance, np.append(np.delete(begin, place), source))
        for place in range(k)
        for source in range(12)
        if source not in begin
    ]
    np.testing.assert_allclose(
        total(distance, apply_best_swap(distance, begin, free, 0.0)),
        min([*every, total(distance, begin)]),
        rtol=1e-12,
    )


def test_a_swap_must_be_worth_it() -> None:
    distance = table(3)
    begin = np.array([0, 1, 2])
    free = np.zeros(3, dtype=bool)
    part = 1.0 - total(distance, apply_best_swap(distance, begin, free, 0.0)) / total(distance, begin)
    assert part > 0.0
    assert apply_best_swap(distance, begin, free, part * 1.01) is begin
    assert apply_best_swap(distance, begin, free, part * 0.99) is not begin
    assert apply_best_swap(distance, begin, ~free, 0.0) is begin


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4), given_=st.integers(0, 2))
def test_rebuilding_helps_or_changes_nothing(seed: int, k: int, given_: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    stays = np.arange(k) < given_
    after = rebuild_sources(distance, begin, stays, 0.05)
    assert len(set(after.tolist())) == k
    assert np.array_equal(after[stays], begin[stays])
    assert after is begin or total(distance, after) < 0.95 * total(distance, begin)


@pytest.mark.parametrize("seed", [5, 16, 194, 277])
def test_two_or_three_at_once_help_where_no_swap_does(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    distance, begin, free = table(seed), np.arange(4), np.zeros(4, dtype=bool)
    best = min(total(distance, np.array(some)) for some in combinations(range(12), 4))
    assert total(distance, improve_sources(distance, begin, free, 0.0)) == pytest.approx(best)
    monkeypatch.setattr(k_median, "rebuild_sources", lambda table, sources, fixed, threshold: sources)
    assert total(distance, improve_sources(distance, begin, free, 0.0)) > 1.01 * best


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 4))
def test_one_moves_to_the_best_of_some(seed: int, k: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    among = np.random.default_rng(seed + 1).random(12) < 0.5
    others = begin[1:]
    after = move_first_source(distance, begin, among, 0.02)
    every = [total(distance, np.append(others, some)) for some in among.nonzero()[0]]
    before, least = total(distance, begin), min(every, default=np.inf)
    np.testing.assert_allclose(total(distance, after), least if least < 0.98 * before else before)
    assert np.array_equal(after[1:], others)


def test_what_a_plan_saves_must_be_worth_it_as_a_whole() -> None:
    for seed in range(20):
        distance, begin, free = table(seed), np.arange(3), np.zeros(3, dtype=bool)
        near, best = run_lloyd(distance, begin, free), improve_sources(distance, begin, free, 0.0)
        part = 1.0 - total(distance, best) / total(distance, near)
        assert np.array_equal(improve_sources(distance, begin, free, part + 1e-6), near)
        if part > 1e-3:
            assert np.array_equal(improve_sources(distance, begin, free, part - 1e-6), best)


def test_plans_are_near_the_best_there_is() -> None:
    ratios = []
    for seed in range(30):
        distance = table(seed)
        found = improve_sources(distance, np.arange(3), np.zeros(3, dtype=bool), 0.0)
        best = min(total(distance, np.array(some)) for some in combinations(range(12), 3))
        ratios.append(total(distance, found) / best)
    assert np.median(ratios) < 1.0 + 1e-9
    assert max(ratios) < 1.03


@st.composite
def tables(draw):
    """Tables of distances, some of points in the plane and some of anything, and a number of sources."""
    sources, targets = draw(st.integers(1, 14)), draw(st.integers(1, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    if draw(st.booleans()):
        one, other = rng.random((targets, 1, 2)), rng.random((sources, 2))
        table = np.hypot(*np.moveaxis(one - other, -1, 0))
    else:
        # with many equal distances
        table = rng.integers(0, 5, (targets, sources)).astype(float)
    return table * rng.integers(1, 4, (targets, 1)), draw(st.integers(1, sources)), rng


@given(tables())
def test_seeds_are_different_sources(drawn):
    table, count, rng = drawn
    sources = seed_sources(table, count, rng)
    assert sources.shape == (count,)
    assert len(set(sources.tolist())) == count


def test_seeds_are_far_from_each_other():
    # two clusters far apart: hardly ever both seeds fall into one
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.random((20, 2)), rng.random((20, 2)) + 1000.0])
    table = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
    both = [len(set(seed_sources(table, 2, np.random.default_rng(k)) < 20)) - 1 for k in range(200)]
    assert sum(both) > 195
    # and a first seed is anywhere
    first = [int(seed_sources(table, 1, np.random.default_rng(k))[0]) for k in range(400)]
    assert len(set(first)) == 40


@given(tables())
def test_neither_iteration_ever_raises_the_cost(drawn):
    table, count, rng = drawn
    start = rng.choice(table.shape[1], count, replace=False)
    given_ = start.copy()
    for iteration in (run_lloyd, apply_best_swaps):
        end = iteration(table, start)
        assert len(set(end.tolist())) == count
        assert total(table, end) <= total(table, start) * (1.0 + 1e-12)
        np.testing.assert_array_equal(start, given_)


@given(tables())
def test_no_swap_is_left_that_would_lower_the_cost(drawn):
    table, count, rng = drawn
    end = apply_best_swaps(table, rng.choice(table.shape[1], count, replace=False)).tolist()
    reached = total(table, end)
    for place in range(count):
        for source in range(table.shape[1]):
            swapped = [*end[:place], source, *end[place + 1 :]]
            assert total(table, swapped) >= reached * (1.0 - 1e-8)


@given(tables())
def test_alternation_ends_where_each_source_is_the_best_of_its_own_targets(drawn):
    table, count, rng = drawn
    end = run_lloyd(table, rng.choice(table.shape[1], count, replace=False))
    owner = table[:, end].argmin(axis=1)
    fresh = []
    for place in range(count):
        sums = table[owner == place].sum(axis=0)
        sums[[source for other, source in enumerate(end) if other != place]] = np.inf
        fresh.append(int(sums.argmin()) if (owner == place).any() else int(end[place]))
    if len(set(fresh)) == count:
        assert total(table, fresh) >= total(table, end) * (1.0 - 1e-8)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_interchange_from_some_starts_finds_the_best_of_all(count):
    rng = np.random.default_rng(count)
    one, other = rng.random((40, 1, 2)), rng.random((12, 2))
    table = np.hypot(*np.moveaxis(one - other, -1, 0))
    best = min(total(table, some) for some in combinations(range(12), count))
    found = [total(table, apply_best_swaps(table, seed_sources(table, count, rng))) for _ in range(10)]
    assert min(found) == pytest.approx(best, abs=1e-12)


def test_giving_up():
    table = np.random.default_rng(0).random((50, 20))

    def stop():
        raise KeyboardInterrupt

    for iteration in (run_lloyd, apply_best_swaps):
        with pytest.raises(KeyboardInterrupt):
            iteration(table, np.arange(3), heartbeat=stop)


@given(seed=st.integers(0, 10_000), k=st.integers(1, 4))
def test_greedy_candidates_achieve_most_of_the_best_reduction(seed: int, k: int) -> None:
    """Nemhauser, Wolsey and Fisher (1978): 1 - 1/e of it; and each is the best beside the earlier ones."""
    distance = table(seed, sources=9)
    chosen = choose_greedily(distance, k)
    assert len(set(chosen.tolist())) == k
    for number in range(k):
        sums = [total(distance, np.append(chosen[:number], source)) for source in range(9)]
        assert sums[chosen[number]] <= min(sums) + 1e-9
    nothing = len(distance) * distance.max()
    best = min(total(distance, np.array(some)) for some in combinations(range(9), k))
    assert nothing - total(distance, chosen) >= (1.0 - 1.0 / np.e) * (nothing - best) - 1e-9
