"""The k-median problem: swaps, rebuilding and thresholds."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

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

SEEDS_WITH_STUCK_SWAPS = [5, 16, 194, 277]
"""Random seeds for which swaps alone do not find the optimum."""


def build_random_distances(seed: int, sources: int = 12, targets: int = 30) -> np.ndarray:
    """Return the distances of points in a square, (targets, sources), with a random weight per target."""
    rng = np.random.default_rng(seed)
    source_positions = rng.uniform(0, 10, (sources, 2))
    target_positions = rng.uniform(0, 10, (targets, 2))
    distance = np.linalg.norm(source_positions - target_positions[:, None], axis=2)
    return distance * rng.uniform(0.5, 2.0, (targets, 1))


def compute_cost(distance: np.ndarray, sources: np.ndarray) -> float:
    return float(distance[:, list(sources)].min(axis=1).sum())


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 10_000), k=st.integers(1, 5), fixed_count=st.integers(0, 5))
def test_improvements_lower_the_cost_and_keep_fixed_sources(seed: int, k: int, fixed_count: int) -> None:
    distance = build_random_distances(seed)
    start = np.random.default_rng(seed).permutation(12)[:k]
    is_fixed = np.arange(k) < min(fixed_count, k)
    for improved in (run_lloyd(distance, start, is_fixed), apply_best_swap(distance, start, is_fixed, 0.0)):
        assert compute_cost(distance, improved) <= compute_cost(distance, start) + 1e-9
    after = improve_sources(distance, start, is_fixed, 0.0)
    assert len(set(after.tolist())) == k
    assert np.array_equal(after[is_fixed], start[is_fixed])
    assert compute_cost(distance, after) <= compute_cost(distance, start) + 1e-9


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4))
def test_the_best_swap_agrees_with_an_exhaustive_search(seed: int, k: int) -> None:
    distance = build_random_distances(seed)
    start = np.random.default_rng(seed).permutation(12)[:k]
    is_fixed = np.zeros(k, dtype=bool)
    costs = [compute_cost(distance, start)]
    unused_sources = set(range(12)) - set(start.tolist())
    for index in range(k):
        others = np.delete(start, index)
        costs += [compute_cost(distance, np.append(others, source)) for source in unused_sources]
    swapped = apply_best_swap(distance, start, is_fixed, 0.0)
    np.testing.assert_allclose(compute_cost(distance, swapped), min(costs), rtol=1e-12)


def test_a_swap_must_save_more_than_the_threshold() -> None:
    distance = build_random_distances(3)
    start = np.array([0, 1, 2])
    is_fixed = np.zeros(3, dtype=bool)
    swapped = apply_best_swap(distance, start, is_fixed, 0.0)
    saving = 1.0 - compute_cost(distance, swapped) / compute_cost(distance, start)
    assert saving > 0.0
    assert apply_best_swap(distance, start, is_fixed, saving * 1.01) is start
    assert apply_best_swap(distance, start, is_fixed, saving * 0.99) is not start
    assert apply_best_swap(distance, start, ~is_fixed, 0.0) is start


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4), fixed_count=st.integers(0, 2))
def test_rebuilding_lowers_the_cost_or_changes_nothing(seed: int, k: int, fixed_count: int) -> None:
    distance = build_random_distances(seed)
    start = np.random.default_rng(seed).permutation(12)[:k]
    is_fixed = np.arange(k) < fixed_count
    after = rebuild_sources(distance, start, is_fixed, 0.05)
    assert len(set(after.tolist())) == k
    assert np.array_equal(after[is_fixed], start[is_fixed])
    assert after is start or compute_cost(distance, after) < 0.95 * compute_cost(distance, start)


@pytest.mark.parametrize("seed", SEEDS_WITH_STUCK_SWAPS)
def test_rebuilding_finds_the_optimum_where_swaps_do_not(seed: int) -> None:
    distance = build_random_distances(seed)
    start = np.arange(4)
    is_fixed = np.zeros(4, dtype=bool)
    best = min(compute_cost(distance, np.array(sources)) for sources in combinations(range(12), 4))
    assert compute_cost(distance, improve_sources(distance, start, is_fixed, 0.0)) == pytest.approx(best)
    without_rebuilding = improve_sources(distance, start, is_fixed, 0.0, removals=False)
    assert compute_cost(distance, without_rebuilding) > 1.01 * best


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 10_000), k=st.integers(1, 4))
def test_the_first_source_moves_to_the_best_allowed_candidate(seed: int, k: int) -> None:
    distance = build_random_distances(seed)
    start = np.random.default_rng(seed).permutation(12)[:k]
    is_allowed = np.random.default_rng(seed + 1).random(12) < 0.5
    others = start[1:]
    after = move_first_source(distance, start, is_allowed, 0.02)
    costs = [compute_cost(distance, np.append(others, candidate)) for candidate in is_allowed.nonzero()[0]]
    expected = compute_cost(distance, start)
    min_cost = min(costs, default=np.inf)
    if min_cost < 0.98 * expected:
        expected = min_cost
    np.testing.assert_allclose(compute_cost(distance, after), expected)
    assert np.array_equal(after[1:], others)


def test_the_total_saving_must_exceed_the_threshold() -> None:
    for seed in range(20):
        distance = build_random_distances(seed)
        start = np.arange(3)
        is_fixed = np.zeros(3, dtype=bool)
        lloyd = run_lloyd(distance, start, is_fixed)
        best = improve_sources(distance, start, is_fixed, 0.0)
        saving = 1.0 - compute_cost(distance, best) / compute_cost(distance, lloyd)
        assert np.array_equal(improve_sources(distance, start, is_fixed, saving + 1e-6), lloyd)
        if saving > 1e-3:
            assert np.array_equal(improve_sources(distance, start, is_fixed, saving - 1e-6), best)


def test_improved_sources_are_nearly_optimal() -> None:
    ratios = []
    for seed in range(30):
        distance = build_random_distances(seed)
        improved = improve_sources(distance, np.arange(3), np.zeros(3, dtype=bool), 0.0)
        best = min(compute_cost(distance, np.array(sources)) for sources in combinations(range(12), 3))
        ratios.append(compute_cost(distance, improved) / best)
    assert np.median(ratios) < 1.0 + 1e-9
    assert max(ratios) < 1.03


@st.composite
def problems(draw):
    """Distances of points in the plane or without geometry, a number of sources, and a generator."""
    source_count = draw(st.integers(1, 14))
    target_count = draw(st.integers(1, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    if draw(st.booleans()):
        targets = rng.random((target_count, 1, 2))
        sources = rng.random((source_count, 2))
        distance = np.hypot(*np.moveaxis(targets - sources, -1, 0))
    else:
        # Many of these distances are equal.
        distance = rng.integers(0, 5, (target_count, source_count)).astype(float)
    weights = rng.integers(1, 4, (target_count, 1))
    return distance * weights, draw(st.integers(1, source_count)), rng


@given(problems())
def test_seeds_are_distinct_sources(problem):
    distance, count, rng = problem
    sources = seed_sources(distance, count, rng)
    assert sources.shape == (count,)
    assert len(set(sources.tolist())) == count


def test_seeds_are_far_from_each_other():
    # Two clusters are far apart. Both seeds are hardly ever in the same one.
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.random((20, 2)), rng.random((20, 2)) + 1000.0])
    distance = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
    seeds = [seed_sources(distance, 2, np.random.default_rng(k)) for k in range(200)]
    assert sum(len(set(pair < 20)) == 2 for pair in seeds) > 195
    # The first seed may be any source.
    first = [int(seed_sources(distance, 1, np.random.default_rng(k))[0]) for k in range(400)]
    assert len(set(first)) == 40


@given(problems())
def test_iterations_do_not_increase_the_cost_or_change_their_input(problem):
    distance, count, rng = problem
    start = rng.choice(distance.shape[1], count, replace=False)
    original_start = start.copy()
    for iteration in (run_lloyd, apply_best_swaps):
        end = iteration(distance, start)
        assert len(set(end.tolist())) == count
        assert compute_cost(distance, end) <= compute_cost(distance, start) * (1.0 + 1e-12)
        np.testing.assert_array_equal(start, original_start)


@given(problems())
def test_no_further_swap_lowers_the_cost(problem):
    distance, count, rng = problem
    end = apply_best_swaps(distance, rng.choice(distance.shape[1], count, replace=False)).tolist()
    final_cost = compute_cost(distance, end)
    for index in range(count):
        for source in range(distance.shape[1]):
            swapped = [*end[:index], source, *end[index + 1 :]]
            assert compute_cost(distance, swapped) >= final_cost * (1.0 - 1e-8)


@given(problems())
def test_lloyd_ends_with_the_best_source_for_the_targets_of_each_source(problem):
    distance, count, rng = problem
    end = run_lloyd(distance, rng.choice(distance.shape[1], count, replace=False))
    owner = distance[:, end].argmin(axis=1)
    best_sources = end.copy()
    for index in range(count):
        if (owner == index).any():
            sums = distance[owner == index].sum(axis=0)
            sums[np.delete(end, index)] = np.inf
            best_sources[index] = sums.argmin()
    if len(set(best_sources.tolist())) == count:
        assert compute_cost(distance, best_sources) >= compute_cost(distance, end) * (1.0 - 1e-8)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_swaps_from_several_starts_find_the_optimum(count):
    rng = np.random.default_rng(count)
    targets = rng.random((40, 1, 2))
    sources = rng.random((12, 2))
    distance = np.hypot(*np.moveaxis(targets - sources, -1, 0))
    best = min(compute_cost(distance, choice) for choice in combinations(range(12), count))
    costs = []
    for _ in range(10):
        start = seed_sources(distance, count, rng)
        costs.append(compute_cost(distance, apply_best_swaps(distance, start)))
    assert min(costs) == pytest.approx(best, abs=1e-12)


def test_a_heartbeat_may_stop_the_iterations():
    distance = np.random.default_rng(0).random((50, 20))

    def stop():
        raise KeyboardInterrupt

    for iteration in (run_lloyd, apply_best_swaps):
        with pytest.raises(KeyboardInterrupt):
            iteration(distance, np.arange(3), heartbeat=stop)


@given(seed=st.integers(0, 10_000), k=st.integers(1, 4))
def test_greedy_candidates_achieve_most_of_the_best_reduction(seed: int, k: int) -> None:
    """Nemhauser, Wolsey and Fisher (1978) prove a fraction of 1 - 1/e. Each step is the best one."""
    distance = build_random_distances(seed, sources=9)
    chosen = choose_greedily(distance, k)
    assert len(set(chosen.tolist())) == k
    for number in range(k):
        sums = [compute_cost(distance, np.append(chosen[:number], source)) for source in range(9)]
        assert sums[chosen[number]] <= min(sums) + 1e-9
    initial_cost = len(distance) * distance.max()
    best = min(compute_cost(distance, np.array(sources)) for sources in combinations(range(9), k))
    min_reduction = (1.0 - 1.0 / np.e) * (initial_cost - best)
    assert initial_cost - compute_cost(distance, chosen) >= min_reduction - 1e-9
