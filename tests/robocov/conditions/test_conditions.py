"""Conditions: checks of parameters, working periods of robots, and JSON."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.conditions import Conditions, DensityKnowledge, Failure, Join, parse_event
from robocov.errors import ParameterError


def test_conditions_are_ideal_unless_one_has_an_effect() -> None:
    assert Conditions().is_ideal
    assert Conditions(seed=4, forget_after=1.0).is_ideal
    for parameters in (
        {"loss": 0.1},
        {"delay": 0.1},
        {"message_rate": 2.0},
        {"bandwidth": 1e4},
        {"position_noise": 0.1},
    ):
        assert Conditions(**parameters).uses_messages
        assert not Conditions(**parameters).is_ideal
    for parameters in (
        {"sensing_noise": 0.1},
        {"failure_rate": 0.1},
        {"failures": ((1, 2),)},
        {"joins": ((1, 2),)},
        {"density": "sensed"},
    ):
        assert not Conditions(**parameters).uses_messages
        assert not Conditions(**parameters).is_ideal


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"loss": 1.5}, "conditions.loss: expected a number from 0 to 1, got 1.5"),
        ({"loss": True}, "conditions.loss: expected a number from 0 to 1, got True"),
        ({"delay": -1}, "conditions.delay: expected a number from 0 to 1000 s, got -1"),
        ({"delay": math.nan}, "conditions.delay: expected a number from 0 to 1000 s, got nan"),
        ({"message_rate": 0}, r"conditions.message_rate: expected .* Hz or null, got 0"),
        (
            {"position_noise": "much"},
            "conditions.position_noise: expected a number from 0 to 1000 m, got 'much'",
        ),
        (
            {"message_rate": 0.1},
            "conditions.forget_after: expected at least 10 s, the time between two messages, got 3 s",
        ),
        (
            {"failures": ((0, 1.0),)},
            r"conditions.failures\[0\]: expected the number of a robot, from 1, got 0",
        ),
        (
            {"failures": ((1, 1), (1, 2))},
            r"conditions.failures\[1\]: expected one event per robot, got robot 1 twice",
        ),
        (
            {"failures": ((1, math.inf),)},
            r"conditions.failures\[0\]: expected a time from 0 to 1000000 s, got inf",
        ),
        ({"failures": 5}, r"conditions.failures: expected a sequence of events, got 5"),
        ({"joins": None}, r"conditions.joins: expected a sequence of events, got None"),
        ({"failures": (3,)}, r"conditions.failures\[0\]: expected a robot and a time, got 3"),
        (
            {"joins": ((1, 2, (1, 2, 3)),)},
            r"conditions.joins\[0\]: expected a position \[x, y\] in meters, got \(1, 2, 3\)",
        ),
        (
            {"joins": ((1, 2, (1, math.nan)),)},
            r"conditions.joins\[0\]: expected a position .* got \(1, nan\)",
        ),
        (
            {"joins": ((2, 5),), "failures": ((2, 5),)},
            "expected robot 2 to join before it fails at 5 s, got 5 s",
        ),
        ({"seed": -1}, "conditions.seed: expected a whole number of at least 0, got -1"),
    ],
)
def test_invalid_conditions_are_rejected(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message) as caught:
        Conditions(**parameters)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_a_team_must_contain_the_robots_of_all_events() -> None:
    Conditions(failures=((3, 1),)).check_team(3)
    with pytest.raises(
        ParameterError, match=r"conditions.failures\[0\]: expected a robot from 1 to 2, got robot 3"
    ):
        Conditions(failures=((3, 1),)).check_team(2)
    with pytest.raises(ParameterError, match="expected at least one robot from the start"):
        Conditions(joins=((1, 1), (2, 2))).check_team(2)
    Conditions(joins=((1, 0), (2, 2))).check_team(2)


def test_robots_work_from_joining_to_failing() -> None:
    conditions = Conditions(failures=((1, 5.0), (3, 7.0)), joins=((2, 4.0), (3, 6.0)))
    working = conditions.find_working_robots(np.array([0.0, 3.99, 4.0, 5.0, 6.5, 7.0]), 4)
    assert working.astype(int).tolist() == [
        [1, 0, 0, 1],
        [1, 0, 0, 1],
        [1, 1, 0, 1],
        [0, 1, 0, 1],
        [0, 1, 1, 1],
        [0, 1, 0, 1],
    ]
    assert conditions.find_failed_robots(7.0, 4).tolist() == [True, False, True, False]
    assert conditions.find_present_robots(5.0, 4).tolist() == [True, True, False, True]


def test_rounding_of_time_does_not_shift_events_by_a_step() -> None:
    conditions = Conditions(failures=((1, 0.8),))
    time = float(np.add.accumulate(np.full(8, 0.1))[-1])
    assert time < 0.8
    assert conditions.find_failed_robots(time, 1).all()
    assert not conditions.find_failed_robots(0.79, 1).any()
    assert Conditions(joins=((1, 0.8),)).find_working_robots(time, 2).all()


def test_lifetimes_are_exponential() -> None:
    """Bounds are five standard errors wide."""
    count = 20_000
    _, stops = Conditions(failure_rate=0.02, seed=5).compute_working_periods(count)
    assert abs(stops.mean() * 0.02 - 1.0) < 5 / math.sqrt(count)
    assert abs((stops > 50.0).mean() - math.exp(-1.0)) < 5 * 0.5 / math.sqrt(count)


def test_lifetimes_depend_on_robot_and_seed_alone() -> None:
    _, stops = Conditions(failure_rate=0.02, seed=5).compute_working_periods(3)
    _, stops_in_larger_team = Conditions(failure_rate=0.02, seed=5).compute_working_periods(9)
    np.testing.assert_array_equal(stops_in_larger_team[:3], stops)
    # A robot that joins later works as long.
    _, late_stops = Conditions(failure_rate=0.02, seed=5, joins=((1, 1e5),)).compute_working_periods(3)
    assert late_stops[0] - 1e5 == pytest.approx(stops[0])
    _, other_stops = Conditions(failure_rate=0.02, seed=6).compute_working_periods(3)
    assert (other_stops != stops).all()


times = st.floats(0, 1e5, allow_nan=False)


@given(
    st.floats(0, 1),
    st.one_of(st.none(), st.floats(0.5, 60.0)),
    st.dictionaries(st.integers(1, 9), times, max_size=3),
    st.dictionaries(st.integers(10, 19), st.tuples(times, st.one_of(st.none(), st.tuples(times, times)))),
    st.integers(0, 2**62),
    st.sampled_from(["known", "sensed"]),
)
def test_conditions_are_unchanged_by_json(
    loss: float,
    rate: float | None,
    fails: dict[int, float],
    joins: dict[int, tuple[float, object]],
    seed: int,
    density: DensityKnowledge,
) -> None:
    conditions = Conditions(
        loss=loss,
        message_rate=rate,
        failures=tuple(Failure(*each) for each in fails.items()),
        joins=tuple(Join(robot, *rest) for robot, rest in joins.items()),  # type: ignore[arg-type]
        seed=seed,
        density=density,
    )
    assert Conditions.from_dict(json.loads(json.dumps(conditions.to_dict(), allow_nan=False))) == conditions


def test_conditions_of_earlier_versions_have_no_bandwidth() -> None:
    data = Conditions(bandwidth=1e4).to_dict()
    assert Conditions.from_dict(data).bandwidth == 1e4
    del data["bandwidth_bytes_per_s"]
    assert Conditions.from_dict(data) == Conditions()


def test_the_former_key_of_a_joining_position_is_read() -> None:
    conditions = Conditions(joins=((2, 5.0, (1.0, 3.0)), (3, 5.0)))
    document = conditions.to_dict()
    for join in document["joins"]:
        join["place_m"] = join.pop("position_m")
    assert Conditions.from_dict(document) == conditions


def test_a_known_density_does_not_change_files_of_earlier_versions() -> None:
    assert "density" not in Conditions().to_dict()
    assert Conditions(density="sensed").to_dict()["density"] == "sensed"


def test_an_unknown_density_is_not_ideal() -> None:
    assert not Conditions(density="sensed").is_ideal
    conditions = Conditions(density="sensed", failures=((1, 2.0),))
    assert conditions.drop_team_changes() == Conditions(density="sensed")
    with pytest.raises(ParameterError, match=r"conditions\.density: expected known or sensed, got 'hidden'"):
        Conditions(density="hidden")  # type: ignore[arg-type]


def test_unreadable_conditions_are_rejected() -> None:
    with pytest.raises(ParameterError, match=r"^conditions: missing key 'delay_s'$"):
        Conditions.from_dict({"loss": 0.5})
    broken = Conditions().to_dict() | {"failures": [{"robot": 1}]}
    with pytest.raises(ParameterError, match=r"^conditions: missing key 'time_s'$"):
        Conditions.from_dict(broken)
    with pytest.raises(ParameterError, match=r"^conditions: cannot be read: "):
        Conditions.from_dict(Conditions().to_dict() | {"failures": 3})


def test_events_are_parsed_from_text() -> None:
    assert parse_event(Failure, "3@20") == (3, 20.0)
    assert parse_event(Join, "5@30") == (5, 30.0, None)
    assert parse_event(Join, "5@1.5:2.5,-1") == (5, 1.5, (2.5, -1.0))
    for text in ("3", "3@", "@20", "a@20", "3@x", "3@20s", "-1@2", "3@inf", "3@1@2"):
        with pytest.raises(ParameterError, match="expected ROBOT@SECONDS, as in 3@20, got"):
            parse_event(Failure, text)
    for text in ("3@2:", "3@2:1", "3@2:1,", "3@2:1,2,3", "3@2:a,b", "3@2:nan,1"):
        with pytest.raises(ParameterError, match="expected ROBOT@SECONDS or ROBOT@SECONDS:X,Y, got"):
            parse_event(Join, text)


@given(st.text("0123456789@:,.-+e x", max_size=12))
def test_any_text_is_a_join_or_gives_a_message_of_one_line(text: str) -> None:
    try:
        join = parse_event(Join, text)
    except ParameterError as error:
        assert "\n" not in str(error)
    else:
        assert parse_event(Join, text) == parse_event(Join, str(join)) == join


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (Failure(3, 20.0), "3@20"),
        (Failure(3, 1234.5678), "3@1234.5678"),
        (Join(5, 30.0, (2.5, 1e-7)), "5@30:2.5,1e-07"),
        (Join(5, 1e6, (385123.25, -0.1)), "5@1e+06:385123.25,-0.1"),
    ],
)
def test_the_text_of_an_event_contains_its_exact_numbers(event: Failure | Join, text: str) -> None:
    assert str(event) == text
    assert parse_event(type(event), text) == event


def test_reprs_contain_what_differs_from_the_defaults() -> None:
    assert repr(Conditions(loss=0.2)) == "Conditions(loss=0.2)"
    assert eval(repr(Conditions(loss=0.2, failures=((1, 2),)))) == Conditions(loss=0.2, failures=((1, 2),))


def test_the_earlier_of_two_failures_counts() -> None:
    _, random_stops = Conditions(failure_rate=1.0, seed=5).compute_working_periods(2)
    failures = ((1, 500.0), (2, 1e-6))
    _, stops = Conditions(failure_rate=1.0, seed=5, failures=failures).compute_working_periods(2)
    assert stops.tolist() == [random_stops[0], 1e-6]


def test_advanced_conditions_have_the_same_events_earlier() -> None:
    conditions = Conditions(
        loss=0.1,
        failure_rate=0.02,
        failures=((1, 1.0), (2, 5.0)),
        joins=((3, 1.0), (4, 4.0, (2.0, 1.0))),
        seed=3,
    )
    advanced = conditions.advance(2.0, robot_count=5)
    assert advanced.loss == conditions.loss
    assert advanced.joins == ((4, 2.0, (2.0, 1.0)),)
    times = np.linspace(0.0, 100.0, 501)
    for find in ("find_working_robots", "find_present_robots"):
        expected = getattr(conditions, find)(2.0 + times, 5)
        np.testing.assert_array_equal(getattr(advanced, find)(times, 5), expected)
