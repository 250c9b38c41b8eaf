"""Explanations of the motion of a robot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from drawn_run import HALL, ROOMS, SQUARE
from hypothesis import given
from hypothesis import strategies as st
from robot_reports import assert_consistent, assert_forces_sum_up, build_report, get_line, list_texts

from robocov import Rapf, Simulation, Team
from robocov.observation import Decision
from robocov.voronoi import partition
from robocov_app.viewer.explanation.explain import explain, explain_robot
from robocov_app.viewer.explanation.quantities import format_direction, format_force, format_length
from robocov_app.viewer.explanation.situation import UNEXPLAINED_FORCE

# lengths, forces and directions


def test_format_direction():
    angles = np.arange(8) * np.pi / 4
    directions = [format_direction(complex(np.cos(angle), np.sin(angle))) for angle in angles]
    assert directions == "east northeast north northwest west southwest south southeast".split()
    assert format_direction(0j) == ""
    assert format_direction(-1 - 1e-9j) == "west"
    assert format_direction(complex(2.0, 5e-324)) == "east"


@pytest.mark.parametrize(
    ("meters", "text"),
    [
        (-1e-5, "0 mm"),
        (0, "0 mm"),
        (0.0042, "4 mm"),
        (0.01, "1 cm"),
        (0.42, "42 cm"),
        (0.994, "99 cm"),
        (0.996, "1.0 m"),
        (2.44, "2.4 m"),
        (9.96, "10 m"),
        (24.4, "24 m"),
        (1e9, "over a million m"),
    ],
)
def test_format_length(meters, text):
    assert format_length(meters) == text


@pytest.mark.parametrize(
    ("newtons", "text"),
    [
        (0, "0 N"),
        (4e-4, "0 N"),
        (0.0042, "4 mN"),
        (0.022, "22 mN"),
        (0.0994, "99 mN"),
        (0.0996, "0.10 N"),
        (0.314, "0.31 N"),
        (2, "2.0 N"),
        (12.3, "12 N"),
    ],
)
def test_format_force(newtons, text):
    assert format_force(newtons) == text


# given observations and decisions


def test_each_force_is_described_with_its_cause():
    report = build_report(
        [[2, 4], [1.2, 4], [2, 6]],
        goals=[[5, 4], [0, 0], [0, 0]],
        points=[[2, 3.58], [np.nan] * 2, [np.nan] * 2],
        velocities=[[0.2, 0], [0, 0], [0, 0]],
        attraction=[[0.31, 0], [0, 0], [0, 0]],
        repulsion_robots=[[0.12, 0], [0, 0], [0, 0]],
        repulsion_obstacle=[[0, 0.3], [0, 0], [0, 0]],
        names=[4, 7, 9],
    )
    assert report.title == "Robot 4"
    assert report.verdict == "moving east to its goal at 0.20 m/s"
    assert list_texts(report) == [
        "at (2.00, 4.00) m, 0.20 m/s east",
        "pulled with 0.31 N toward its goal, 3.0 m away",
        "repelled with 0.12 N by robot 7, 80 cm west (2 robots in range)",
        "repelled with 0.30 N by the obstacle, 42 cm south",
        "slowed with 0.40 N by viscosity",
        "resultant of these forces 0.30 N north",
        "its rim is 32 cm from the obstacle south of it",
        "2 robots in communication range; the nearest is robot 7, 80 cm west",
    ]
    assert get_line(report, "attraction").vector == (0.31, 0.0)
    assert get_line(report, "viscosity").vector == (-0.4, 0.0)
    assert_forces_sum_up(report)


def test_robots_at_similar_distances_are_named_together():
    report = build_report([[4, 4], [3, 4], [4, 5.2], [4, 0.5]], repulsion_robots=[[0.3, -0.2], *[[0, 0]] * 3])
    pushed = (
        "repelled southeast with 0.36 N by robot 2, 1.0 m west and robot 3, 1.2 m north (3 robots in range)"
    )
    assert get_line(report, "repulsion_robots").text == pushed


@pytest.mark.parametrize(
    ("point", "name"),
    [
        ((4, 5), "the obstacle"),
        ((0, 5), "the outer wall"),
        ((8.1, 1), "the wall"),
        ((10.05, 2.8), "the obstacle"),
    ],
)
def test_an_obstacle_is_named_by_its_kind(point, name):
    position = np.array(point) - [0.5, 0.0]
    report = build_report([position], points=[point], environment=ROOMS, repulsion_obstacle=[[-1.0, 0.0]])
    assert get_line(report, "repulsion_obstacle").text == f"repelled with 1.0 N by {name}, 50 cm east"


@pytest.mark.parametrize(
    ("environment", "position", "goal", "hidden"),
    [
        (ROOMS, (3, 5), (3, 6), ""),
        (ROOMS, (3, 5), (6, 5), ", behind an obstacle"),
        (ROOMS, (3, 5), (4.4, 5), ", inside an obstacle"),
        (ROOMS, (4.4, 8), (2.5, 8), ", behind an obstacle"),  # a courtyard
        (HALL, (10, 2), (5, 9), ", behind the outer wall"),
        (HALL, (10, 2), (10, 8), ", outside the map"),
        (HALL, (5, 2), (5, 9), ""),
    ],
)
def test_obstructed_goals_are_described(environment, position, goal, hidden):
    pull = np.array(goal, dtype=float) - position
    away = format_length(float(np.hypot(*pull))) + " away" + hidden
    size = format_force(float(np.hypot(*pull)))
    report = build_report([position], goals=[goal], environment=environment, attraction=[pull])
    assert get_line(report, "attraction").text == f"pulled with {size} toward its goal, {away}"
    held = build_report([position], goals=[goal], environment=environment, attraction=[pull], lift=[-pull])
    assert held.verdict.startswith("at rest, stuck: " if hidden else "at rest ")
    assert any(text.startswith("stuck: ") for text in list_texts(held)) == bool(hidden)


def test_two_balancing_forces_are_named():
    report = build_report(
        [[3.4, 5]],
        goals=[[6, 5]],
        points=[[4, 5]],
        environment=ROOMS,
        attraction=[[0.31, 0]],
        repulsion_obstacle=[[-0.3, 0]],
        swarm_cohesion=[[0.001, 0]],
    )
    assert report.verdict == "at rest, stuck: its goal is 2.6 m away, behind an obstacle"
    assert (
        "stuck: the pull to its goal (0.31 N) and the repulsion of the obstacle (0.30 N) balance"
        in list_texts(report)
    )
    assert "pushed east with 1 mN by swarm cohesion" in list_texts(report)


def test_three_balancing_forces_are_named():
    forces = {"attraction": [[0, 1]], "repulsion_obstacle": [[0.87, -0.5]], "wind": [[-0.87, -0.5]]}
    report = build_report([[3, 3]], goals=[[3, 5]], **forces)
    assert report.verdict == "at rest 2.0 m short of its goal: the forces balance"
    balance = "the pull to its goal (1.0 N) and the repulsion of obstacles (1.0 N) and wind (1.0 N) balance"
    assert balance in list_texts(report)


def test_forces_of_a_creeping_robot_do_not_balance_without_viscosity():
    report = build_report(
        [[3.4, 5]],
        goals=[[3.4, 5.09]],
        points=[[4, 5]],
        velocities=[[0, 0.004]],
        environment=ROOMS,
        attraction=[[0, 0.022]],
        repulsion_obstacle=[[0, -0.007]],
    )
    assert report.verdict == "at rest 9 cm from its goal"
    assert "pulled with 22 mN toward its goal, 9 cm away" in list_texts(report)
    assert not any("balance" in text for text in list_texts(report))


@pytest.mark.parametrize(("force", "is_reported"), [(1.99, False), (2.03, False), (2.2, True)])
def test_a_limit_is_reported_if_the_shown_numbers_differ(force: float, is_reported: bool):
    report = build_report([[2.0, 5]], goals=[[5, 5]], attraction=[[force, 0.0]])
    assert any(text.startswith("acceleration limited") for text in list_texts(report)) is is_reported


def test_a_robot_pressed_against_an_obstacle_is_held_by_it():
    east = {"goals": [[5, 5]], "attraction": [[10.0, 0.0]], "environment": ROOMS}
    report = build_report([[3.9, 5]], points=[[4, 5]], **east)
    assert report.verdict == "at rest, stuck: its goal is 1.1 m away, behind an obstacle"
    assert "stuck: the pull to its goal (10 N) presses it against the obstacle" in list_texts(report)
    resultant = "resultant of these forces 10 N east, opposed by the obstacle"
    assert get_line(report, "resultant").text == resultant
    assert "touches the obstacle east of it" in list_texts(report)
    assert "acceleration limited to 2.0 m/s² (the forces ask for 10 m/s²)" in list_texts(report)
    blind = build_report([[3.9, 5]], sensing_range=0.05, **east)
    assert blind.verdict == report.verdict
    assert "touches the obstacle east of it" in list_texts(blind)
    assert "senses nothing within 5 cm" in list_texts(blind)
    away = build_report([[3.9, 5]], points=[[4, 5]], environment=ROOMS, wind=[[-1.0, 0.0]])
    assert away.verdict == "setting off west"
    sliding = build_report([[3.9, 5]], points=[[4, 5]], velocities=[[0, -0.5]], **east)
    assert sliding.verdict == "sliding south at 0.50 m/s along the obstacle"


def test_touching_robots():
    report = build_report([[4, 4], [4.2, 4]], wind=[[1, 0], [0, 0]])
    assert report.verdict == "at rest, held by robot 2"
    assert "wind (1.0 N) presses it against robot 2" in list_texts(report)


@pytest.mark.parametrize(
    ("distance", "verdict"),
    [
        (0.0, "arrived: at rest on its goal"),
        (0.03, "arrived: at rest on its goal"),
        (0.2, "at rest 20 cm from its goal"),
        (0.5, "at rest 50 cm short of its goal: no force acts on it"),
    ],
)
def test_robots_near_their_goals(distance, verdict):
    assert build_report([[4, 4]], goals=[[4, 4 + distance]]).verdict == verdict


def test_a_pushed_robot_has_not_arrived():
    """It hardly moves, but has moved to and fro too much to be setting off."""
    path = np.array([[4.0, 4.0], [4.0, 4.03], [4.0, 4.0]])
    for goal, away in ((4.1, "10 cm"), (4.5, "50 cm")):
        report = build_report([[4, 4]], goals=[[goal, 4]], wind=[[0.5, 0]], recent=path)
        assert report.verdict == f"{away} from its goal, not at rest: a force of 0.50 N east acts on it"


def test_arrival_near_a_goal_inside_an_obstacle():
    report = build_report([[3.85, 5]], goals=[[4.1, 5]], environment=ROOMS)
    assert report.verdict == "at rest 25 cm from its goal, which is inside an obstacle"


@pytest.mark.parametrize(
    ("velocity", "force", "verdict"),
    [
        ((0.58, 0.58), (0, 0), "moving northeast to its goal at 0.82 m/s"),
        ((-0.5, 0), (-1, 0), "moving west at 0.50 m/s; its goal is 2.8 m away"),
        ((0.5, 0.5), (-3, -3), "braking from 0.71 m/s northeast; its goal is 2.8 m away"),
        ((0.02, 0), (1, 1), "setting off northeast to its goal"),
        ((0.02, 0), (-1, 0), "setting off west"),
    ],
)
def test_motion_is_described_by_speed(velocity, force, verdict):
    report = build_report([[4, 4]], velocities=[velocity], goals=[[6, 6]], forces=[force], viscosity=0.0)
    assert report.verdict == verdict


def build_wave(size, turns, drift=0.0, k=31):
    phase = np.linspace(0, 1, k)
    return np.column_stack([4 + size * np.sin(2 * np.pi * turns * phase) + drift * phase, np.full(k, 4.0)])


def build_turn():
    """Return the path of a robot that has moved back and forth, and travels now."""
    jitter = build_wave(0.08, 6)
    return np.vstack([jitter, jitter[-1] + [[0.02 * step, 0.0] for step in range(1, 15)]])


@pytest.mark.parametrize(
    ("recent", "speed", "verdict"),
    [
        (build_wave(0.0, 0), 0.0, "at rest, no force acts on it"),
        (build_wave(0.001, 8), 0.04, "at rest, no force acts on it"),
        (build_wave(0.01, 8), 0.2, "at rest (trembling by less than 5 cm)"),
        (build_wave(0.01, 8), 0.0, "at rest (trembling by less than 5 cm)"),  # at a turning point
        (build_wave(0.1, 4), 0.5, "trembling in place"),
        (build_wave(0.0, 0), 0.2, "at rest (trembling by less than 5 cm)"),  # too fast for the samples
        (build_turn(), 0.34, "moving east at 0.34 m/s"),
        (build_wave(0.0, 0, drift=2.0), 0.5, "moving east at 0.50 m/s"),
        (build_wave(0.0, 0, drift=0.08), 0.02, "moving east at 0.02 m/s"),
        (build_wave(0.0, 0, drift=0.03), 0.3, "moving east at 0.30 m/s"),  # has just set off
        (build_wave(0.0, 0, drift=2.0), 0.001, "at rest, no force acts on it"),
        (build_wave(0.0, 0, drift=2.0)[:1], 0.5, "moving east at 0.50 m/s"),
        (build_wave(0.0, 0, drift=2.0)[:0], 0.5, "moving east at 0.50 m/s"),
        (np.full((5, 2), np.nan), 0.5, "moving east at 0.50 m/s"),
    ],
)
def test_motion_is_described_by_recent_positions(recent, speed, verdict):
    velocities = [[speed, 0.0]]
    assert build_report([[4, 4]], velocities=velocities, recent=recent, viscosity=0.0).verdict == verdict


def test_a_trembling_robot_may_be_stuck():
    report = build_report([[3, 5]], goals=[[6, 5]], environment=ROOMS, recent=build_wave(0.03, 8))
    assert report.verdict == "trembling in place, stuck: its goal is 3.0 m away, behind an obstacle"


def test_a_swaying_robot_is_not_setting_off():
    push = {"forces": [[0.2, 0.0]]}
    assert build_report([[4, 4]], recent=build_wave(0.002, 2), **push).verdict == "setting off east"
    assert (
        build_report([[4, 4]], recent=build_wave(0.01, 1), **push).verdict
        == "a force of 0.20 N east acts on it"
    )


def test_speed_and_acceleration_limits_are_described():
    fast = build_report([[4, 4]], velocities=[[1, 0]], max_speed=1.0)
    assert "at its maximum speed, 1.0 m/s" in list_texts(fast)
    thrown = build_report([[4, 4]], velocities=[[5, 0]], max_speed=1.0)
    assert "faster than its maximum speed, 1.0 m/s" in list_texts(thrown)
    heavy = build_report([[4, 4]], forces=[[10, 0]], mass=20.0, max_acceleration=0.6)
    assert not [text for text in list_texts(heavy) if "limited" in text]


@pytest.mark.parametrize(
    ("reach", "text"),
    [(3.0, "senses nothing within 3.0 m"), (np.inf, "senses nothing"), (0.0, "senses nothing")],
)
def test_missing_surroundings_are_described(reach, text):
    report = build_report([[4, 4]], sensing_range=reach)
    assert text in list_texts(report)
    assert "no robot in communication range" in list_texts(report)


def test_only_robots_in_communication_range_are_counted():
    report = build_report([[4, 4], [5, 4], [7, 4]], communication_range=1.5)
    assert "1 robot in communication range: robot 2, 1.0 m east" in list_texts(report)


def test_a_goal_at_the_centroid_is_named():
    positions = np.array([[1.0, 1.0], [7.0, 7.0]])
    cells = partition(positions, SQUARE.region)
    report = build_report(positions, goals=cells.centroids, cells=cells)
    assert report.verdict.endswith("short of its centroid: no force acts on it")


def test_unexplained_forces_are_described():
    calm = build_report([[4, 4]], forces=[[1.0, 0.0]])
    assert get_line(calm, UNEXPLAINED_FORCE).text == "pushed east with 1.0 N by its controller"
    windy = build_report([[4, 4]], forces=[[1.0, 0.0]], wind=[[0.0, 0.5]])
    assert (
        get_line(windy, UNEXPLAINED_FORCE).text
        == "pushed southeast with 1.1 N by other forces of its controller"
    )
    for report in (calm, windy):
        assert_forces_sum_up(report)


def test_invalid_terms_of_user_controllers_are_ignored():
    terms = {
        "viscosity": [[1.0, 0.0]],
        "resultant": [[1.0, 0.0]],
        "text": "none",
        "short": [],
        "wild": [[np.nan] * 2],
    }
    team = Team.homogeneous(1)
    simulation = Simulation(SQUARE, Rapf(), [[4.0, 4.0]], team)
    decision = Decision(np.array([[1.0, 0.0]]), None, terms)
    report = explain(replace(simulation.observe_and_decide(), decision=decision), team, SQUARE, 0)
    assert [line.kind for line in report.lines if line.kind] == [UNEXPLAINED_FORCE, "viscosity", "resultant"]
    assert_forces_sum_up(report)


def test_a_force_that_is_not_finite_is_reported():
    report = build_report([[4, 4]], velocities=[[0.5, 0]], forces=[[np.nan, 1.0]])
    assert "its controller returned an invalid force" in list_texts(report)
    assert get_line(report, "resultant").vector == (-1.0, 0.0)


def test_braking_before_the_goal_is_not_described_as_a_pull():
    report = build_report([[4, 4]], goals=[[4.2, 4]], velocities=[[0.8, 0]], attraction=[[-3.0, 0.0]])
    assert get_line(report, "attraction").text == "braked with 3.0 N on the way to its goal, 20 cm away"
    assert report.verdict == "braking from 0.80 m/s east; its goal is 20 cm away"
    aside = build_report([[4, 4]], goals=[[6, 4]], attraction=[[1.0, 1.0]])
    assert (
        get_line(aside, "attraction").text == "pulled northeast with 1.4 N on the way to its goal, 2.0 m away"
    )


# random observations and decisions


numbers = st.floats(-1e3, 1e3) | st.sampled_from([0.0, -0.0, 1e-300, 1e-9, 4.0])
wild = numbers | st.sampled_from([np.nan, np.inf, -np.inf, 1e300, 1e9])


@st.composite
def draw_arguments(draw):
    n = draw(st.integers(1, 4))

    def draw_rows(values):
        pair = st.tuples(values, values)
        return np.array(draw(st.lists(pair, min_size=n, max_size=n)), dtype=float)

    kinds = ["attraction", "repulsion_robots", "repulsion_obstacle", "swarm_cohesion", "viscosity"]
    terms = {kind: draw_rows(wild) for kind in draw(st.lists(st.sampled_from(kinds), unique=True))}
    if draw(st.booleans()):
        forces = sum((np.nan_to_num(term, posinf=0, neginf=0) for term in terms.values()), np.zeros((n, 2)))
    else:
        forces = draw_rows(wild)
    place = st.floats(-1, 17) | st.sampled_from([0.0, 4.0, 16.0])
    recent = draw(
        st.none() | st.lists(st.tuples(place, place), max_size=5).map(lambda r: np.reshape(r, (-1, 2)))
    )
    limits = {
        "viscosity": draw(st.sampled_from([0.0, 2.0])),
        "mass": draw(st.sampled_from([1e-6, 1.0, 1e6])),
        "sensing_range": draw(st.sampled_from([0.0, 3.0, np.inf])),
        "communication_range": draw(st.sampled_from([0.0, 3.0, np.inf])),
    }
    return {
        "positions": draw_rows(place),
        "velocities": draw_rows(st.floats(-2, 2) | st.sampled_from([0.0, 1e-300])),
        "forces": forces,
        "goals": draw_rows(place | st.just(np.nan)) if draw(st.booleans()) else None,
        "points": draw_rows(place | st.just(np.nan)),
        "environment": draw(st.sampled_from([ROOMS, HALL, SQUARE])),
        "recent": recent,
        "robot": draw(st.integers(0, n - 1)),
        **limits,
        **{kind: term for kind, term in terms.items() if kind not in limits},
    }


@given(draw_arguments())
def test_reports_of_random_snapshots_are_consistent(arguments):
    assert_consistent(build_report(**arguments))


def test_the_position_of_a_failed_robot_has_no_negative_zero():
    setup = SimpleNamespace(failed={2: (-0.001, 3.0)})
    session = SimpleNamespace(displayed=SimpleNamespace(get_setup=lambda pane: setup))
    report = explain_robot(SimpleNamespace(session=session, pane=None), 2)
    assert report.verdict.startswith("failed: it stays at (0.00, 3.00) m")
