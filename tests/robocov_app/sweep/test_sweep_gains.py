"""Sweeps over gains: lists, sets and random samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Poduri, Rapf, Rpf, get_gain_values, get_gains
from robocov.errors import ParameterError
from robocov_app.sweep.study.gains import build_gains
from robocov_app.sweep.study.sampling import Range, Sampling, SamplingMethod

METHODS = ("sobol", "halton", "latin-hypercube")


@dataclass(frozen=True)
class Still:
    name = "still"


def test_without_gains_a_controller_has_its_defaults() -> None:
    assert build_gains(Rpf, {}, None).choices == ({"k_rep": 3.0, "rho_0": 4.0},)
    assert build_gains(Still, {}, None).choices == ({},)


def test_lists_are_combined_in_order() -> None:
    gains = build_gains(Rapf, {"k_rep": [0.1, 1], "attraction_limit": [2.0, None], "k_att": 3}, None)
    tried = [(choice["k_rep"], choice["attraction_limit"]) for choice in gains.choices]
    assert tried == [(0.1, 2.0), (0.1, None), (1.0, 2.0), (1.0, None)]
    assert all(choice["k_att"] == 3.0 and choice["rho_0"] == Rapf().rho_0 for choice in gains.choices)
    assert all(list(choice) == list(get_gains(Rapf)) for choice in gains.choices)


def test_sets_of_gains_are_not_combined() -> None:
    paper = {"k_rep": 1, "rho_0": 2, "k_att": 3, "attraction_limit": None}
    gains = build_gains(Rapf, [paper, {}], None)
    assert gains.choices == (get_gain_values(Rapf(**paper)), get_gain_values(Rapf()))
    assert build_gains(Rapf, gains, None) == gains


def test_former_names_in_a_study_are_accepted() -> None:
    gains = build_gains(Poduri, {"neighbours": [1, 2]}, None)
    assert [choice["neighbors"] for choice in gains.choices] == [1.0, 2.0]


@pytest.mark.parametrize("word", ["null", float("inf")])
def test_null_and_infinity_mean_no_limit(word: object) -> None:
    (choice,) = build_gains(Rapf, {"attraction_limit": word}, None).choices
    assert choice["attraction_limit"] is None


@given(
    low=st.floats(1e-3, 10.0),
    factor=st.floats(1.5, 1e4),
    scale=st.sampled_from(["linear", "log"]),
    method=st.sampled_from(METHODS),
    samples=st.integers(1, 70),
    seed=st.integers(0, 10**6),
)
def test_samples_are_in_their_ranges_and_reproducible(
    low: float, factor: float, scale: str, method: SamplingMethod, samples: int, seed: int
) -> None:
    ranges = {"k_rep": Range(low, low * factor, scale), "rho_0": Range(0.5, 4.0)}
    gains = build_gains(Rpf, ranges, Sampling(method, samples, seed))
    assert gains == build_gains(Rpf, ranges, Sampling(method, samples, seed))
    assert gains.ranges == ranges
    assert len(gains.choices) == samples
    for name, each in ranges.items():
        values = [choice[name] for choice in gains.choices]
        assert all(each.low <= value <= each.high for value in values)
        assert len(set(values)) == samples


@pytest.mark.parametrize("method", METHODS)
def test_samples_are_evenly_spread_on_the_scale_of_a_range(method: SamplingMethod) -> None:
    ranges = {"k_rep": Range(0.01, 100.0, "log"), "rho_0": Range(1.0, 3.0)}
    gains = build_gains(Rpf, ranges, Sampling(method, 64, 3))
    decades = np.log10([choice["k_rep"] for choice in gains.choices])
    assert np.histogram(decades, bins=4, range=(-2, 2))[0] == pytest.approx(16, abs=2)
    reach = [choice["rho_0"] for choice in gains.choices]
    assert np.histogram(reach, bins=4, range=(1, 3))[0] == pytest.approx(16, abs=2)


def test_rounding_does_not_leave_the_range() -> None:
    assert Range(1 / 3, 2 / 3).interpolate(np.array([0.0, 0.5, 1.0])) == [1 / 3, 0.5, 2 / 3]


@pytest.mark.parametrize(("method", "grows"), [("sobol", True), ("halton", True), ("latin-hypercube", False)])
def test_more_samples_keep_the_first_ones(method: SamplingMethod, grows: bool) -> None:
    ranges = {"k_rep": Range(0.1, 10.0), "rho_0": Range(1.0, 3.0)}
    few = build_gains(Rpf, ranges, Sampling(method, 5)).choices
    many = build_gains(Rpf, ranges, Sampling(method, 40)).choices
    assert (many[:5] == few) is grows


def test_controllers_with_the_same_ranges_get_the_same_samples() -> None:
    ranges = {"k_rep": Range(0.1, 10.0), "rho_0": Range(1.0, 3.0)}
    sampling = Sampling(samples=7, seed=2)
    tried = [
        [(choice["k_rep"], choice["rho_0"]) for choice in build_gains(kind, ranges, sampling).choices]
        for kind in (Rapf, Rpf)
    ]
    assert tried[0] == tried[1]


def test_lists_are_combined_with_every_sample() -> None:
    gains = build_gains(Rapf, {"k_att": [3, 30], "k_rep": Range(0.1, 10.0)}, Sampling(samples=4))
    assert [choice["k_att"] for choice in gains.choices] == [3.0] * 4 + [30.0] * 4
    assert [choice["k_rep"] for choice in gains.choices[:4]] == [c["k_rep"] for c in gains.choices[4:]]


@dataclass(frozen=True)
class Picky:
    k: float = 1.0

    def __post_init__(self) -> None:
        if self.k == 2.0:
            raise ValueError("not two")


WRONG = [
    (Rapf, {"k_rap": 1}, "gains.x: unknown gain 'k_rap': did you mean 'k_rep'? (known: "),
    (Rapf, {"k_rep": -1}, "gains.x.k_rep: expected a number from 0 to 1000000 N m³, got -1"),
    (Rapf, {"k_rep": [1, "big"]}, "gains.x.k_rep[1]: expected a number from "),
    (
        Rapf,
        {"k_rep": [1, 2, 1.0]},
        "gains.x.k_rep[2]: duplicate value 1.0, already given at gains.x.k_rep[0]",
    ),
    (Rapf, {"k_rep": []}, "gains.x.k_rep: expected at least one value, got none"),
    (Rapf, {"k_rep": None}, "gains.x.k_rep: expected a number from "),
    (Rapf, [], "gains.x: expected at least one set of gains, got none"),
    (Rapf, [{"k_rep": 1}, {"k_rep": 1}], "gains.x[1]: duplicate value {'k_rep': 1.0, "),
    (Rapf, [{"k_rep": -1}], "gains.x[0].k_rep: expected "),
    (Rapf, {"k_rep": Range(2, 1)}, "gains.x.k_rep.high: expected a number above 2, got 1"),
    (Rapf, {"k_rep": Range(-1, 1)}, "gains.x.k_rep.low: expected a number from 0 to "),
    (Rapf, {"k_rep": Range(0, 1, "log")}, "gains.x.k_rep.low: expected a number above 0 for "),
    (Rapf, {"k_rep": Range(0, 1, "lag")}, "gains.x.k_rep.scale: unknown scale 'lag': did you mean 'log'?"),
    (
        Rapf,
        {"attraction_limit": Range(1, None)},
        "gains.x.attraction_limit.high: expected a number, got None",
    ),
    (Rapf, {"k_rep": Range(1.0, 1.0000001)}, "gains.x.samples[1]: duplicate value {'k_rep': 1.0, "),
    (
        Picky,
        {"k": [1, 2]},
        "controller 'Picky' cannot be created: ValueError: not two (test_sweep_gains.py",
    ),
    (object, {"k": 1}, "gains.x: expected no gains, as the controller has none, got 'k'"),
]


@pytest.mark.parametrize(("kind", "gains", "message"), WRONG)
def test_invalid_gains_are_rejected_with_their_place(kind: type, gains: object, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        build_gains(kind, gains, Sampling(samples=8), ("gains", "x"))
    assert str(caught.value).startswith(message)


def test_a_range_without_sampling_is_rejected() -> None:
    with pytest.raises(ParameterError, match=r"^gains\.rpf\.k_rep: expected a table \[sampling\]"):
        build_gains(Rpf, {"k_rep": Range(1, 2)}, None, ("gains", "rpf"))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "sobool"}, "sampling.method: unknown method 'sobool': did you mean 'sobol'?"),
        ({"samples": 0}, "sampling.samples: expected a whole number from 1 to 100000, got 0"),
        ({"samples": 2.0}, "sampling.samples: expected a whole number"),
        ({"seed": -1}, "sampling.seed: expected a whole number"),
    ],
)
def test_invalid_sampling_is_rejected(settings: dict, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        Sampling(**settings)
    assert str(caught.value).startswith(message)
