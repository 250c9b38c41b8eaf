"""Sessions whose past is a record: displayed, resumed and edited, also without their controllers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_run import record_walk
from sample_sessions import HALL, LLOYD, RAPF, RPF, advance_session, get_positions, start_session
from session_records import COUNTING, build_record, build_records, have_same_arrays

from robocov import run
from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.environment import ObstaclePath
from robocov.errors import InputError, ParameterError
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import WeightedCells
from robocov_app.runs.saved_runs import SavedRun, build_roster
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.session import recorded
from robocov_app.viewer.session.recorded import build_replay_session, get_control_period
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.missing_controller import MissingController, find_controller

STEPS = 60
DT = 1 / 60
THINNED_ARRAYS = ("time", "positions", "velocities", "forces", "goals", "obstacle_points")
MISSING_MESSAGE = (
    r"not resumed: Counting is not one of .*; to resume the run, open it with --controller FILE.py:Counting$"
)


def build_saved_run(record: Record, history: CostHistory | None = None, name: str = "saved") -> SavedRun:
    return SavedRun(Path(name), record, history)


def replay(*records: Record, controllers: tuple[str, ...] = ()) -> Session:
    """Return a session of records, which is paused and displays time 0."""
    runs = [build_saved_run(record, name=f"saved/{index}") for index, record in enumerate(records)]
    session = build_replay_session(runs, controllers)
    session.playback.is_playing = False
    return session


def record_run(*controllers: ControllerChoice, steps: int = STEPS, robots: int = 4, **changes) -> Record:
    session = start_session(*controllers, robots=robots, **changes)
    return build_record(advance_session(session, steps))


def play_frames(session: Session, frames: int) -> None:
    session.playback.is_playing = True
    for _ in range(frames):
        session.playback.advance(DT)


def get_present_positions(session: Session) -> np.ndarray:
    return session.timeline.panes[0].simulation.positions


def get_present_velocities(session: Session) -> np.ndarray:
    return session.timeline.panes[0].simulation.velocities


@pytest.fixture(scope="module")
def record() -> Record:
    return record_run()


@pytest.fixture
def counting(tmp_path: Path) -> ControllerChoice:
    """A controller with memory, in a file."""
    path = tmp_path / "mine.py"
    path.write_text(COUNTING)
    return ControllerChoice(f"{path}:Counting")


# Displaying


def test_a_replay_starts_at_time_0_and_plays(record: Record) -> None:
    session = build_replay_session([build_saved_run(record)])
    assert session.playback.is_playing
    assert not session.timeline.is_live
    assert session.displayed.time == 0.0
    assert session.timeline.end_time == 1.0
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.timeline.scenario.start_name == "corner"
    np.testing.assert_array_equal(get_positions(session)[0], record.positions[0])
    play_frames(session, 30)
    assert session.displayed.time == pytest.approx(0.5)
    np.testing.assert_array_equal(get_positions(session)[0], record.positions[30])


@pytest.mark.parametrize("controller", [RAPF, RPF, LLOYD], ids=lambda choice: choice.name)
def test_every_state_is_that_of_the_record(controller: ControllerChoice) -> None:
    record = record_run(controller)
    session = replay(record)
    for step in (0, 17, STEPS):
        session.show_time(step * DT)
        snapshot = session.displayed.get_snapshot(session.timeline.panes[0])
        np.testing.assert_array_equal(snapshot.positions, record.positions[step])
        np.testing.assert_array_equal(snapshot.velocities, record.velocities[step])
        np.testing.assert_allclose(snapshot.decision.forces, record.forces[step], rtol=1e-12)
        np.testing.assert_array_equal(snapshot.seen.obstacle_points, record.obstacle_points[step])
        assert snapshot.decision.terms
    assert session.timeline.is_live


def test_trails_and_sensed_points_are_those_of_the_record(record: Record) -> None:
    session = replay(record)
    pane = session.timeline.panes[0]
    session.show_time(0.5)
    positions, times = session.displayed.get_trail(pane)
    assert times[-1] == pytest.approx(0.5, abs=1 / 30)
    np.testing.assert_array_equal(positions[-1], record.positions[round(times[-1] / DT)])
    np.testing.assert_array_equal(pane.starts, record.positions[0])
    simulated_pane = advance_session(start_session(robots=4), STEPS).timeline.panes[0]
    np.testing.assert_array_equal(pane.sensed.get_until(0.9)[0], simulated_pane.sensed.get_until(0.9)[0])


def test_the_cost_curve_is_that_of_the_file(record: Record) -> None:
    times = np.linspace(0.0, 1.0, 11)
    history = CostHistory(times, 3.0 - times, 10.0 - times, 0.0 * times)
    pane = build_replay_session([build_saved_run(record, history)]).timeline.panes[0]
    np.testing.assert_allclose(pane.distance_curve.times, times)
    np.testing.assert_allclose(pane.distance_curve.values, 3.0 - times)
    without_costs = build_replay_session([build_saved_run(record)])
    assert len(without_costs.timeline.panes[0].distance_curve) == 0


def test_curves_of_a_record_that_starts_later_begin_at_0_s(record: Record) -> None:
    late_record = replace(record, time=record.time + 5.0)
    times = np.linspace(5.0, 6.0, 11)
    history = CostHistory(times, 8.0 - times, 10.0 - times, 0.0 * times)
    session = build_replay_session([build_saved_run(late_record, history)])
    assert session.timeline.end_time == 1.0
    np.testing.assert_allclose(session.timeline.panes[0].distance_curve.times, times - 5.0, atol=1e-12)


def test_a_record_that_needs_too_much_memory_is_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    record = record_run(steps=400)
    complete_pane = replay(record).timeline.panes[0]
    monkeypatch.setattr(recorded, "MAX_HISTORY_BYTES", 0)
    monkeypatch.setattr(recorded, "MAX_RECORD_BYTES", 100_000)
    session = replay(record)
    assert session.timeline.history.thinned > 0
    session.show_time(session.timeline.end_time)
    np.testing.assert_array_equal(get_positions(session)[0], record.positions[-1])
    pane = session.timeline.panes[0]
    np.testing.assert_array_equal(pane.sensed.get_until(9.0)[0], complete_pane.sensed.get_until(9.0)[0])


def test_the_present_of_a_record_with_one_state_is_displayed(record: Record) -> None:
    session = replay(record_run(steps=0))
    assert session.timeline.is_live
    advance_session(session, 5)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[5])


# Resuming


@pytest.mark.parametrize(
    "controller", [RAPF, LLOYD, ControllerChoice("rpf", {"k_rep": 1.0})], ids=lambda choice: choice.name
)
def test_a_record_is_continued_bit_for_bit(controller: ControllerChoice) -> None:
    expected = advance_session(start_session(controller, robots=8, start="spread"), 2 * STEPS)
    session = replay(record_run(controller, robots=8, start="spread"))
    play_frames(session, STEPS + 5)
    assert session.timeline.is_live
    assert session.timeline.is_at_record_end
    assert not session.playback.is_playing, "users decide whether to continue"
    play_frames(session, STEPS)
    assert session.timeline.is_live
    assert not session.timeline.is_at_record_end
    assert session.timeline.end_time == expected.timeline.end_time
    np.testing.assert_array_equal(get_present_positions(session), get_present_positions(expected))
    np.testing.assert_array_equal(get_present_velocities(session), get_present_velocities(expected))
    assert have_same_arrays(build_record(session), build_record(expected))
    assert build_record(session).session == {}


def test_a_record_can_be_continued_from_any_state(record: Record) -> None:
    session = replay(record)
    session.show_time(0.4)
    assert session.branch()
    assert session.timeline.end_time == pytest.approx(0.4)
    advance_session(session, STEPS - 24)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])


def test_the_end_of_a_record_can_be_entered_again(record: Record) -> None:
    session = replay(record)
    session.show_time(0.4)
    session.fail_robot(1)
    advance_session(session, 5)
    session.seek(session.timeline.document.nodes[0])
    assert session.timeline.end_time == pytest.approx(1.0)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])
    assert session.timeline.history.steps == list(range(STEPS + 1))


def test_a_record_can_be_edited_at_any_state(record: Record) -> None:
    session = replay(record)
    session.show_time(0.5)
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.fail_robot(2)
    assert session.timeline.is_live
    assert session.displayed.numbers == (1, 3, 4)
    advance_session(session, 10)
    assert session.timeline.head.parent is not None


def test_a_restart_returns_to_the_start_of_the_record(record: Record) -> None:
    session = replay(record)
    session.show_time(0.5)
    session.restart()
    advance_session(session, STEPS)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])
    session.restart(seed=7)
    expected = HALL.start("corner").sample(4, seed=7, radius=0.1)
    np.testing.assert_array_equal(get_present_positions(session), expected)


def test_a_restart_uses_the_start_of_the_record_even_if_the_map_does_not_define_it() -> None:
    assert "uniform" not in HALL.starts
    session = replay(Scenario(HALL, "lloyd", robots=4, start="uniform", seed=1, duration=0.2).run())
    assert session.timeline.scenario.start == "uniform"
    session.restart(seed=7)
    expected = HALL.start("uniform").sample(4, seed=7, radius=0.1)
    np.testing.assert_array_equal(get_present_positions(session), expected)


# Records of parts of sessions


def test_a_record_has_the_numbers_and_failed_robots_of_its_session() -> None:
    original = advance_session(start_session(robots=4), 30)
    original.fail_robot(2)
    advance_session(original, 30)
    session = replay(build_record(original))
    setup = session.displayed.get_setup(session.timeline.panes[0])
    assert session.displayed.numbers == (1, 3, 4)
    assert list(setup.failed) == [2]
    assert setup.environment == HALL
    assert session.timeline.end_time == pytest.approx(0.5)
    session.show_time(session.timeline.end_time)
    for continued in (original, session):
        continued.revive_robot(2)
        advance_session(continued, 20)
    assert sorted(session.displayed.numbers) == [1, 2, 3, 4]
    assert session.displayed.numbers == original.displayed.numbers
    np.testing.assert_array_equal(get_present_positions(session), get_present_positions(original))


def test_a_restart_returns_to_the_initial_velocities_of_the_same_robots() -> None:
    original = advance_session(start_session(robots=4), 30)
    original.set_controller(original.timeline.panes[0], LLOYD)
    record = build_record(advance_session(original, 30))
    session = replay(record)
    assert session.timeline.scenario.start is None
    session.restart()
    advance_session(session, 30)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])
    session.restart(robots=2)
    assert not get_present_velocities(session).any()


def test_a_restart_returns_to_the_initial_headings_of_unicycles() -> None:
    team = Team.homogeneous(4, kinematics="unicycle")
    starts = HALL.start("uniform").sample(4, seed=3, radius=0.1)
    steering = [[2.0, 0.0], [-2.0, 0.0], [1.0, 0.0], [3.0, 0.0]]
    record = Scenario(HALL, RAPF.build(), team=team, starts=starts, steering=steering, duration=0.5).run()
    session = replay(record)
    session.restart()
    advance_session(session, 30)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])


def test_a_record_of_every_fourth_step_is_continued_with_its_control_period(record: Record) -> None:
    arrays = {name: getattr(record, name)[::4] for name in THINNED_ARRAYS}
    coarse = replace(record, dt=record.dt * 4, session={"control_dt_s": record.dt}, **arrays)
    assert get_control_period(coarse) == record.dt
    session = replay(coarse)
    assert session.timeline.history.steps[:3] == [0, 4, 8]
    session.show_time(session.timeline.end_time)
    advance_session(session, 12)
    assert session.timeline.end_time == pytest.approx(1.2)
    session.show_time(0.4)
    session.branch()
    advance_session(session, STEPS - 24)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])


def test_a_thinned_record_is_continued_with_its_control_period(record: Record) -> None:
    session = replay(record.thin(1.0 / (4 * record.dt)))
    assert session.timeline.scenario.dt == record.dt
    assert session.timeline.history.steps[:3] == [0, 4, 8]
    session.show_time(12 * record.dt)
    session.branch()
    np.testing.assert_array_equal(get_present_positions(session), record.positions[12])
    advance_session(session, STEPS - 12)
    np.testing.assert_array_equal(get_present_positions(session), record.positions[-1])


def test_a_record_may_be_thinned_twice(record: Record) -> None:
    rate = 1.0 / (4 * record.dt)
    timeline = replay(record.thin(rate).thin(rate / 3)).timeline
    assert timeline.history.steps[:3] == [0, 12, 24]
    assert timeline.scenario.dt == record.dt


def test_uneven_times_are_rejected(record: Record) -> None:
    with pytest.raises(InputError, match=r"record.npz: time: expected times .* s apart"):
        replay(record.thin(1.0 / (7 * record.dt)))


def test_records_that_start_later_are_rejected_if_obstacles_move(record: Record) -> None:
    path = ObstaclePath(((4.2, 1.2), (4.8, 1.2)), 0.5)
    pillar = replace(HALL.obstacles[0], path=path)
    moving_record = replace(record, environment=replace(HALL, obstacles=(pillar,)))
    assert replay(moving_record).displayed.time == 0.0
    expected = (
        r"saved/0: expected a record from 0 s on, because obstacles move, got one from 5 s on; --frames"
    )
    with pytest.raises(InputError, match=expected):
        replay(replace(moving_record, time=record.time + 5.0))


def test_robots_fail_and_join_after_a_record_that_starts_later_as_in_its_run() -> None:
    # The robots 1 and 5 fail and join before the record, 2 and 4 in it, and 3 and 6 after it.
    conditions = Conditions(
        failures=((1, 0.2), (2, 0.7), (3, 1.5)),
        joins=((5, 0.3), (4, 0.8), (6, 1.6, (5.2, 3.2))),
    )
    starts = HALL.start("spread").sample(6, seed=0)
    simulation = Simulation(HALL, Rapf(), starts, conditions=conditions)
    simulation.run(0.5)
    session = replay(simulation.run(0.5))
    session.show_time(session.timeline.end_time)
    pane = session.timeline.panes[0]
    for expected, steps in [([3, 4, 5], 0), ([4, 5], 33), ([4, 5, 6], 27)]:
        advance_session(session, steps)
        for _ in range(steps):
            simulation.step()
        assert list(pane.numbers) == expected
        np.testing.assert_array_equal(pane.positions, simulation.positions[simulation.is_working])
    texts = [event.text for event in session.timeline.events]
    assert texts[-2:] == ["robot 3 failed", "robot 6 joined"]


@pytest.mark.parametrize(
    "conditions",
    [
        Conditions(failures=((1, 0.1), (2, 0.2))),
        Conditions(failures=((1, 0.2),), joins=((2, 0.3, None),)),
    ],
    ids=["at the end", "for some time"],
)
def test_records_without_a_working_robot_are_rejected(conditions: Conditions) -> None:
    record = run("square", "rapf", robots=2, duration=0.4, conditions=conditions)
    expected = r"saved/0: expected a working robot at all times, got none at 0\.2 s; --frames"
    with pytest.raises(InputError, match=expected):
        replay(record)


@pytest.mark.parametrize(
    "session_content",
    [
        {"robots": [1, 2], "failed": {}},
        {"robots": [1, 2, 3, 3], "failed": {}},
        {"robots": [1, 2, 3, 5], "failed": {"4": [1.0, 1.0]}},
        {"control_dt_s": 0.011},
    ],
)
def test_session_content_that_contradicts_the_record_is_ignored(
    record: Record, session_content: dict
) -> None:
    session = replay(replace(record, session=session_content))
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.timeline.scenario.dt == record.dt
    assert session.timeline.events == []


def test_dragged_robots_are_events(record: Record) -> None:
    drags = [
        {"from_s": 0.1, "to_s": 0.2, "robots": [2, 3]},
        {"from_s": 0.1, "to_s": 0.3, "robots": [4]},
    ]
    events = replay(replace(record, session={"edits": drags})).timeline.events
    assert [(event.time, event.kind, event.text) for event in events] == [
        (0.2, "hand", "robots 2, 3 were dragged"),
        (0.3, "hand", "robot 4 was dragged"),
    ]


# Comparisons


def test_a_comparison_is_replayed_side_by_side() -> None:
    records = build_records(advance_session(start_session(RAPF, RPF, LLOYD), STEPS))
    session = replay(*records)
    panes = session.timeline.panes
    assert [pane.controller.name for pane in panes] == ["rapf", "rpf", "lloyd"]
    session.show_time(0.5)
    for pane, record in zip(panes, records, strict=True):
        np.testing.assert_array_equal(session.displayed.get_positions(pane), record.positions[30])
    session.branch()
    advance_session(session, 30)
    for pane, record in zip(session.timeline.panes, records, strict=True):
        np.testing.assert_array_equal(pane.simulation.positions, record.positions[-1])


def test_failed_robots_may_be_at_different_positions() -> None:
    original = advance_session(start_session(RAPF, LLOYD), 30)
    original.fail_robot(1)
    session = replay(*build_records(advance_session(original, 10)))
    panes = session.timeline.panes
    for pane, original_pane in zip(panes, original.timeline.panes, strict=True):
        assert session.displayed.get_setup(pane).failed == original_pane.setup.failed
    assert panes[0].setup.environment is panes[1].setup.environment


def set_different_radius(record: Record) -> Record:
    return replace(record, team=replace(record.team, radius=np.array([0.1, 0.1, 0.1, 0.2])))


@pytest.mark.parametrize(
    ("build_other", "message"),
    [
        (lambda record: record_run(steps=5), r"saved/1: states: expected 61 as in saved/0, got 6"),
        (lambda record: record_run(dt=1 / 50), r"saved/1: dt_s: expected 0.016\d* as in"),
        (lambda record: record_run(robots=3), r"saved/1: team: "),
        (
            lambda record: replace(record, time=record.time**2),
            "saved/1/record.npz: time: expected times 0.0166667 s apart",
        ),
        (set_different_radius, "saved/1: team: expected .* as in saved/0, got .*"),
    ],
)
def test_records_that_cannot_be_compared_are_rejected(record: Record, build_other, message: str) -> None:
    with pytest.raises(InputError, match=message):
        replay(record, build_other(record))


def test_too_many_records_are_rejected(record: Record) -> None:
    with pytest.raises(InputError, match="saved: 5 runs, but the window has space for 4"):
        replay(*[record] * 5)


def test_different_robots_keep_their_properties(record: Record) -> None:
    radii = np.array([0.1, 0.1, 0.1, 0.2])
    speeds = np.array([1.0, 0.5, 0.5, 1.0])
    team = replace(record.team, radius=radii, max_speed=speeds)
    session = replay(replace(record, team=team, gains={**record.gains, "cells": "time"}))
    pane = session.timeline.panes[0]
    assert session.displayed.get_setup(pane).team.to_dict() == team.to_dict()
    seen = session.displayed.get_snapshot(pane).seen
    assert seen.max_speeds is not None
    assert seen.max_speeds.tolist() == speeds.tolist()


# Controllers that are missing or have changed


def test_a_record_is_displayed_without_its_controller(counting: ControllerChoice) -> None:
    record = record_run(counting)
    session = replay(record)
    pane = session.timeline.panes[0]
    controller = session.displayed.get_setup(pane).controller
    assert isinstance(controller, MissingController)
    assert controller.label == "Counting"
    for step in (0, 20, STEPS):
        session.show_time(step * DT)
        snapshot = session.displayed.get_snapshot(pane)
        np.testing.assert_array_equal(snapshot.positions, record.positions[step])
        np.testing.assert_array_equal(snapshot.decision.forces, record.forces[step])
        assert snapshot.decision.goals is None


def test_the_package_of_a_missing_controller_without_a_file_is_suggested(counting: ControllerChoice) -> None:
    choice = find_controller(replace(record_run(counting), controller="learner"))
    with pytest.raises(ParameterError, match="install the package that provides 'learner', or open it with"):
        choice.build()


def test_a_record_cannot_be_resumed_without_its_controller(counting: ControllerChoice) -> None:
    session = replay(record_run(counting))
    session.show_time(session.timeline.end_time)
    with pytest.raises(ParameterError, match=MISSING_MESSAGE):
        session.playback.step()
    session.show_time(0.5)
    for edit in (session.branch, session.restart, lambda: session.fail_robot(1)):
        with pytest.raises(ParameterError, match=MISSING_MESSAGE):
            edit()
    assert session.timeline.end_time == 1.0
    assert len(session.timeline.history) == STEPS + 1


def test_another_controller_can_continue_a_record(counting: ControllerChoice) -> None:
    session = replay(record_run(counting))
    session.show_time(session.timeline.end_time)
    session.set_controller(session.timeline.panes[0], RAPF)
    advance_session(session, 10)
    assert session.timeline.end_time == pytest.approx(1.0 + 10 / 60)


def test_the_window_displays_a_record_without_its_controller(
    tmp_path: Path, counting: ControllerChoice
) -> None:
    session = build_replay_session([build_saved_run(record_run(counting))])
    launcher = ViewerLauncher(session, "", tmp_path, size=(900, 600), headless=True, lattice=16)
    with launcher.window() as window:
        for _ in range(40):
            window.run_frame(1 / 30)
        assert window.viewer.session.timeline.is_live
        assert window.viewer.message.startswith("The record ends here")
        window.run_command("pause")
        window.run_frame(1 / 30)
        assert "not resumed" in window.viewer.message
        for tab in ("show", "robot", "parameters"):
            window.panel.show_tab(tab)
            window.run_command("robot:next")
            window.run_frame(1 / 30)
            window.run_frame(1 / 30)


def test_a_controller_that_has_changed_does_not_change_the_past(
    tmp_path: Path, counting: ControllerChoice
) -> None:
    record = record_run(counting)
    (tmp_path / "mine.py").write_text(COUNTING.replace("0.05", "0.5"))
    session = replay(record, controllers=(counting.name,))
    session.show_time(0.5)
    snapshot = session.displayed.get_snapshot(session.timeline.panes[0])
    np.testing.assert_array_equal(snapshot.decision.forces, record.forces[30])
    session.branch()
    assert advance_session(session, 5).timeline.end_time == pytest.approx(0.5 + 5 / 60)


def test_the_memory_of_a_controller_is_recomputed(counting: ControllerChoice) -> None:
    expected = advance_session(start_session(counting, robots=4), STEPS + 20)
    record = replace(record_run(counting), controller="elsewhere/theirs.py:Counting")
    session = replay(record, controllers=("lloyd", counting.name))
    session.show_time(0.5)
    session.branch()
    advance_session(session, STEPS + 20 - 30)
    np.testing.assert_array_equal(get_present_positions(session), get_present_positions(expected))


def test_cells_by_travel_time_are_displayed_without_the_controller(record: Record) -> None:
    team = replace(record.team, max_speed=np.array([1.0, 0.5, 0.5, 1.0]))
    record = replace(record, controller="theirs.py:Mine", team=team, gains={"cells": "time"})
    session = replay(record)
    session.show_time(0.5)
    cells = session.displayed.get_snapshot(session.timeline.panes[0]).decision.cells
    assert isinstance(cells, WeightedCells)
    np.testing.assert_array_equal(cells.centroids, record.compute_cells(30).centroids)


def test_gains_that_do_not_exist_any_more_are_named(record: Record) -> None:
    session = replay(replace(record, gains={"k_repulsion": 1.0}))
    session.show_time(session.timeline.end_time)
    with pytest.raises(ParameterError, match="unknown gain 'k_repulsion'"):
        session.playback.step()


def test_only_gains_that_differ_from_their_defaults_are_chosen(record: Record) -> None:
    assert replay(record).timeline.panes[0].controller == RAPF
    controller = ControllerChoice("rapf", {"k_rep": 0.7})
    assert replay(record_run(controller, steps=3)).timeline.panes[0].controller == controller


def test_records_of_any_origin_are_displayed() -> None:
    """The record ends where no simulation can start, because robots walk through walls."""
    record = replace(record_walk(HALL, 3, steps=20), team=Team.homogeneous(3))
    assert build_roster(record).numbers == (1, 2, 3)
    session = replay(record)
    session.show_time(1.0)
    np.testing.assert_array_equal(get_positions(session)[0], record.positions[10])
