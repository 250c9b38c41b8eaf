"""Rewards of learning robots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov_app.learning.rewards import REWARDS, compute_reference_distance, share_reward
from robocov_app.learning.task import check_kind

STEPS = st.integers(0, 2**32)


@pytest.fixture(scope="module")
def cost(cluttered: Environment) -> CoverageCost:
    return CoverageCost(cluttered, 20)


def sample_positions(environment: Environment, seed: int, n: int = 4) -> np.ndarray:
    return environment.start("uniform").sample(n, seed=seed, radius=0.3)


@settings(max_examples=count_examples(15))
@given(seed=STEPS)
def test_own_rewards_sum_up_to_the_decrease_of_the_cost(cost: CoverageCost, seed: int) -> None:
    positions = sample_positions(cost.environment, seed)
    moved = positions + np.random.default_rng(seed).uniform(-0.1, 0.1, size=positions.shape)
    before = cost(positions)
    after = cost(moved)
    decrease = before.mean_distance - after.mean_distance
    assert share_reward("shared", before, after, 0.1).tolist() == [decrease] * 4
    assert share_reward("own", before, after, 0.1).sum() == pytest.approx(decrease, abs=1e-12)
    assert share_reward("level", before, after, 0.1).tolist() == [-0.1 * after.mean_distance] * 4


def test_a_robot_that_moves_alone_gets_nearly_the_whole_reward(cost: CoverageCost) -> None:
    positions = sample_positions(cost.environment, 5)
    for robot in range(4):
        moved = positions.copy()
        moved[robot] += 0.02, 0.01
        before = cost(positions)
        after = cost(moved)
        own = share_reward("own", before, after, 1.0)
        decrease = before.mean_distance - after.mean_distance
        assert abs(decrease) > 1e-5
        assert own[robot] == pytest.approx(decrease, rel=0.03)


def test_robots_that_stay_get_almost_no_reward(cost: CoverageCost) -> None:
    """After a step of 22 cm, linearization leaves an error of about 1 mm, divided among four robots."""
    rewards = []
    for seed in range(12):
        positions = sample_positions(cost.environment, seed)
        moved = positions.copy()
        moved[0] += 0.2, 0.1
        own = share_reward("own", cost(positions), cost(moved), 1.0)
        assert np.ptp(own[1:]) < 1e-15
        rewards.append(abs(own[1]))
    assert np.mean(rewards) < 2e-4


def test_no_placement_costs_less_than_the_reference(empty: Environment) -> None:
    """In a square, regular grids of 1, 4 and 9 robots cost at most 3% more than the reference."""
    cost = CoverageCost(empty, 40)
    for n in (1, 4, 9):
        side = round(n**0.5)
        grid = (np.stack(np.meshgrid(*[np.arange(side) + 0.5] * 2), -1).reshape(-1, 2)) * 10.0 / side
        best = cost(grid).mean_distance / compute_reference_distance(100.0, n)
        assert 1.0 < best < 1.03
        for seed in range(5):
            assert cost(sample_positions(empty, seed, n)).mean_distance > compute_reference_distance(100.0, n)


def test_unknown_kinds_of_rewards_are_rejected() -> None:
    check_kind("reward", "own", REWARDS)
    with pytest.raises(ParameterError, match="unknown kind of reward 'share': did you mean 'shared'"):
        check_kind("reward", "share", REWARDS)
