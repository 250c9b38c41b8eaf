from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.planning import medians
from robocov.planning.medians import improved, moved, rebuilt, settled, swapped


def table(seed: int, sources: int = 12, targets: int = 30) -> np.ndarray:
    rng = np.random.default_rng(seed)
    places, goals = rng.uniform(0, 10, (sources, 2)), rng.uniform(0, 10, (targets, 2))
    return np.hypot(*(places[:, None] - goals).T).T * rng.uniform(0.5, 2.0, targets)


def total(distance: np.ndarray, sources: np.ndarray) -> float:
    return float(distance[sources].min(axis=0).sum())


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 5), given_=st.integers(0, 5))
def test_plans_get_better_and_keep_what_is_given(seed: int, k: int, given_: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    stays = np.arange(k) < min(given_, k)
    for step in (settled(distance, begin, stays), swapped(distance, begin, stays, 0.0)):
        assert total(distance, step) <= total(distance, begin) + 1e-9
    after = improved(distance, begin, stays, 0.0)
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
        total(distance, swapped(distance, begin, free, 0.0)),
        min([*every, total(distance, begin)]),
        rtol=1e-12,
    )


def test_a_swap_must_be_worth_it() -> None:
    distance = table(3)
    begin = np.array([0, 1, 2])
    free = np.zeros(3, dtype=bool)
    part = 1.0 - total(distance, swapped(distance, begin, free, 0.0)) / total(distance, begin)
    assert part > 0.0
    assert swapped(distance, begin, free, part * 1.01) is begin
    assert swapped(distance, begin, free, part * 0.99) is not begin
    assert swapped(distance, begin, ~free, 0.0) is begin


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4), given_=st.integers(0, 2))
def test_rebuilding_helps_or_changes_nothing(seed: int, k: int, given_: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    stays = np.arange(k) < given_
    after = rebuilt(distance, begin, stays, 0.05)
    assert len(set(after.tolist())) == k
    assert np.array_equal(after[stays], begin[stays])
    assert after is begin or total(distance, after) < 0.95 * total(distance, begin)


@pytest.mark.parametrize("seed", [5, 16, 194, 277])
def test_two_or_three_at_once_help_where_no_swap_does(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    distance, begin, free = table(seed), np.arange(4), np.zeros(4, dtype=bool)
    best = min(total(distance, np.array(some)) for some in combinations(range(12), 4))
    assert total(distance, improved(distance, begin, free, 0.0)) == pytest.approx(best)
    monkeypatch.setattr(medians, "rebuilt", lambda table, sources, given, threshold: sources)
    assert total(distance, improved(distance, begin, free, 0.0)) > 1.01 * best


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), k=st.integers(1, 4))
def test_one_moves_to_the_best_of_some(seed: int, k: int) -> None:
    distance = table(seed)
    begin = np.random.default_rng(seed).permutation(12)[:k]
    among = np.random.default_rng(seed + 1).random(12) < 0.5
    others = begin[1:]
    after = moved(distance, begin, among, 0.02)
    every = [total(distance, np.append(others, some)) for some in among.nonzero()[0]]
    before, least = total(distance, begin), min(every, default=np.inf)
    np.testing.assert_allclose(total(distance, after), least if least < 0.98 * before else before)
    assert np.array_equal(after[1:], others)


def test_what_a_plan_saves_must_be_worth_it_as_a_whole() -> None:
    for seed in range(20):
        distance, begin, free = table(seed), np.arange(3), np.zeros(3, dtype=bool)
        near, best = settled(distance, begin, free), improved(distance, begin, free, 0.0)
        part = 1.0 - total(distance, best) / total(distance, near)
        assert np.array_equal(improved(distance, begin, free, part + 1e-6), near)
        if part > 1e-3:
            assert np.array_equal(improved(distance, begin, free, part - 1e-6), best)


def test_plans_are_near_the_best_there_is() -> None:
    ratios = []
    for seed in range(30):
        distance = table(seed)
        found = improved(distance, np.arange(3), np.zeros(3, dtype=bool), 0.0)
        best = min(total(distance, np.array(some)) for some in combinations(range(12), 3))
        ratios.append(total(distance, found) / best)
    assert np.median(ratios) < 1.0 + 1e-9
    assert max(ratios) < 1.03
