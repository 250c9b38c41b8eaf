from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_run import run_of
from sample_sessions import HALL, LLOYD, RAPF, RPF, advance_session, start_session
from session_records import COUNTING, build_record, build_records, have_same_arrays

from robocov.errors import InputError, ParameterError
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.team import Team
from robocov.voronoi import WeightedCells
from robocov_app.runs.saved_runs import SavedRun, build_roster
from robocov_app.viewer.launch import Launcher
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.missing_controller import MissingController
from robocov_app.viewer.session.recorded import build_replay_session, get_control_period
from robocov_app.viewer.session.session import Session

STEPS = 60


def saved(record: Record, history: CostHistory | None = None, name: str = "saved") -> SavedRun:
    return SavedRun(Path(name), record, history)


def replayed(*records: Record, controllers: tuple[str, ...] = ()) -> Session:
    """Return a session of records, paused at their beginning."""
    runs = [saved(record, name=f"saved/{k}") for k, record in enumerate(records)]
    session = build_replay_session(runs, controllers)
    session.playback.is_playing = False
    return session


def recorded(*laws: ControllerChoice, steps: int = STEPS, robots: int = 4, **changes) -> Record:
    return build_record(advance_session(start_session(*laws, robots=robots, **changes), steps))


@pytest.fixture(scope="module")
def record() -> Record:
    return recorded()


@pytest.fixture
def counting(tmp_path: Path) -> ControllerChoice:
    path = tmp_path / "mine.py"
    path.write_text(COUNTING)
    return ControllerChoice(f"{path}:Counting")


def state_of(session: Session) -> tuple[np.ndarray, np.ndarray]:
    return session.timeline.panes[0].simulation.positions, session.timeline.panes[0].simulation.velocities


# looking at it


def test_it_begins_at_the_beginning_and_plays(record: Record) -> None:
    session = build_replay_session([saved(record)])
    assert session.playback.is_playing
    assert not session.timeline.is_live
    assert (session.displayed.time, session.timeline.end_time) == (0.0, 1.0)
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.timeline.scenario.start_name == "corner"
    np.testing.assert_array_equal(
        session.displayed.get_positions(session.timeline.panes[0]), record.positions[0]
    )
    for _ in range(30):
        session.playback.advance(1 / 60)
    assert session.displayed.time == pytest.approx(0.5)
    np.testing.assert_array_equal(
        session.displayed.get_positions(session.timeline.panes[0]), record.positions[30]
    )


@pytest.mark.parametrize("law", [RAPF, RPF, LLOYD], ids=lambda law: law.name)
def test_every_moment_is_the_recorded_one_with_all_that_explains_it(law: ControllerChoice) -> None:
    record = recorded(law)
    session = replayed(record)
    for k in (0, 17, STEPS):
        session.show_time(k / 60)
        snapshot = session.displayed.get_snapshot(session.timeline.panes[0])
        np.testing.assert_array_equal(snapshot.positions, record.positions[k])
        np.testing.assert_array_equal(snapshot.velocities, record.velocities[k])
        np.testing.assert_allclose(snapshot.decision.forces, record.forces[k], rtol=1e-12)
        np.testing.assert_array_equal(snapshot.seen.obstacle_points, record.obstacle_points[k])
        assert snapshot.decision.terms
    assert session.timeline.is_live


def test_where_it_went_and_what_it_sensed_is_there(record: Record) -> None:
    session = replayed(record)
    pane = session.timeline.panes[0]
    session.show_time(0.5)
    places, times = session.displayed.get_trail(pane)
    assert times[-1] == pytest.approx(0.5, abs=1 / 30)
    np.testing.assert_array_equal(places[-1], record.positions[round(times[-1] * 60)])
    np.testing.assert_array_equal(pane.starts, record.positions[0])
    live = advance_session(start_session(robots=4), STEPS).timeline.panes[0]
    np.testing.assert_array_equal(pane.sensed.until(0.9)[0], live.sensed.until(0.9)[0])


def test_the_curve_is_that_of_the_file(record: Record) -> None:
    time = np.linspace(0.0, 1.0, 11)
    history = CostHistory(time, 3.0 - time, 10.0 - time, 0.0 * time)
    pane = build_replay_session([saved(record, history)]).timeline.panes[0]
    np.testing.assert_allclose(pane.distance_curve.times, time)
    np.testing.assert_allclose(pane.distance_curve.values, 3.0 - time)
    assert len(build_replay_session([saved(record)]).timeline.panes[0].distance_curve) == 0


def test_one_moment_is_the_present(record: Record) -> None:
    session = replayed(recorded(steps=0))
    assert session.timeline.is_live
    advance_session(session, 5)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[5])


# going on


@pytest.mark.parametrize(
    "law", [RAPF, LLOYD, ControllerChoice("rpf", {"k_rep": 1.0})], ids=lambda law: law.name
)
def test_it_goes_on_beyond_its_end_as_if_it_had_never_stopped(law: ControllerChoice) -> None:
    whole = advance_session(start_session(law, robots=8, start="spread"), 2 * STEPS)
    session = replayed(recorded(law, robots=8, start="spread"))
    session.playback.is_playing = True
    for _ in range(STEPS + 5):
        session.playback.advance(1 / 60)
    assert (
        session.timeline.is_live and session.timeline.is_at_record_end and not session.playback.is_playing
    ), "to go on is to be decided"
    session.playback.is_playing = True
    for _ in range(STEPS):
        session.playback.advance(1 / 60)
    assert session.timeline.is_live and not session.timeline.is_at_record_end
    assert session.timeline.end_time == whole.timeline.end_time
    for mine, theirs in zip(state_of(session), state_of(whole), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert have_same_arrays(build_record(session), build_record(whole))
    assert build_record(session).session == {}


def test_it_can_be_gone_on_from_any_moment(record: Record) -> None:
    session = replayed(record)
    session.show_time(0.4)
    assert session.branch()
    assert session.timeline.end_time == pytest.approx(0.4)
    advance_session(session, STEPS - 24)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[-1])


def test_it_can_be_touched_at_any_moment(record: Record) -> None:
    session = replayed(record)
    session.show_time(0.5)
    session.set_controller(session.timeline.panes[0], LLOYD)
    session.fail_robot(2)
    assert session.timeline.is_live
    assert session.displayed.numbers == (1, 3, 4)
    advance_session(session, 10)
    assert session.timeline.head.parent is not None


def test_it_begins_anew_where_it_began(record: Record) -> None:
    session = replayed(record)
    session.show_time(0.5)
    session.restart()
    advance_session(session, STEPS)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[-1])
    session.restart(seed=7)
    np.testing.assert_array_equal(state_of(session)[0], HALL.start("corner").sample(4, seed=7, radius=0.1))


# parts of sessions


def test_a_part_of_a_session_comes_back_with_its_numbers_and_wrecks() -> None:
    before = advance_session(start_session(robots=4), 30)
    before.fail_robot(2)
    advance_session(before, 30)
    session = replayed(build_record(before))
    there = session.displayed.get_setup(session.timeline.panes[0])
    assert session.displayed.numbers == (1, 3, 4)
    assert list(there.failed) == [2]
    assert there.environment == HALL
    assert session.timeline.end_time == pytest.approx(0.5)
    session.show_time(session.timeline.end_time)
    for one in (before, session):
        one.revive_robot(2)
        advance_session(one, 20)
    assert sorted(session.displayed.numbers) == [1, 2, 3, 4]
    assert session.displayed.numbers == before.displayed.numbers
    np.testing.assert_array_equal(state_of(session)[0], state_of(before)[0])


def test_who_moved_at_the_beginning_moves_when_it_begins_anew() -> None:
    before = advance_session(start_session(robots=4), 30)
    before.set_controller(before.timeline.panes[0], LLOYD)
    record = build_record(advance_session(before, 30))
    session = replayed(record)
    assert session.timeline.scenario.start is None
    session.restart()
    advance_session(session, 30)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[-1])
    session.restart(robots=2)
    assert not state_of(session)[1].any(), "other robots begin at rest"


def test_a_record_with_moments_missing_goes_on_at_the_old_pace(record: Record) -> None:
    parts = {
        name: getattr(record, name)[::4]
        for name in ("time", "positions", "velocities", "forces", "goals", "obstacle_points")
    }
    coarse = replace(record, dt=record.dt * 4, session={"control_dt_s": record.dt}, **parts)
    assert get_control_period(coarse) == record.dt
    session = replayed(coarse)
    assert session.timeline.history.steps[:3] == [0, 4, 8]
    session.show_time(session.timeline.end_time)
    advance_session(session, 12)
    assert session.timeline.end_time == pytest.approx(1.2)
    session.show_time(0.4)
    session.branch()
    advance_session(session, STEPS - 24)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[-1])


def test_a_thinned_record_goes_on_at_its_own_pace(record: Record) -> None:
    rate = 1.0 / (4 * record.dt)
    session = replayed(record.thin(rate))
    assert session.timeline.scenario.dt == record.dt
    assert session.timeline.history.steps[:3] == [0, 4, 8]
    session.show_time(12 * record.dt)
    session.branch()
    np.testing.assert_array_equal(state_of(session)[0], record.positions[12])
    advance_session(session, STEPS - 12)
    np.testing.assert_array_equal(state_of(session)[0], record.positions[-1])
    # as one that was thinned before and is thinned again
    again = replayed(record.thin(rate).thin(rate / 3))
    assert again.timeline.history.steps[:3] == [0, 12, 24] and again.timeline.scenario.dt == record.dt


def test_moments_at_uneven_times_are_refused(record: Record) -> None:
    with pytest.raises(InputError, match=r"record.npz: time: expected times .* s apart"):
        replayed(record.thin(1.0 / (7 * record.dt)))


@pytest.mark.parametrize(
    "said",
    [
        {"robots": [1, 2], "failed": {}},
        {"robots": [1, 2, 3, 3], "failed": {}},
        {"robots": [1, 2, 3, 5], "failed": {"4": [1.0, 1.0]}},
        {"control_dt_s": 0.011},
    ],
)
def test_what_of_a_session_does_not_go_with_its_record_is_passed_over(record: Record, said: dict) -> None:
    session = replayed(replace(record, session=said))
    assert session.displayed.numbers == (1, 2, 3, 4)
    assert session.timeline.scenario.dt == record.dt
    assert list(session.timeline.events) == []


def test_hands_are_told_of(record: Record) -> None:
    touched = [{"from_s": 0.1, "to_s": 0.2, "robots": [2, 3]}]
    (event,) = replayed(replace(record, session={"touched": touched})).timeline.events
    assert (event.time, event.kind, event.text) == (0.2, "hand", "robot 2, 3 was dragged")


# side by side


def test_a_comparison_is_side_by_side() -> None:
    before = advance_session(start_session(RAPF, RPF, LLOYD), STEPS)
    records = build_records(before)
    session = replayed(*records)
    assert [pane.controller.name for pane in session.timeline.panes] == ["rapf", "rpf", "lloyd"]
    session.show_time(0.5)
    for pane, record in zip(session.timeline.panes, records, strict=True):
        np.testing.assert_array_equal(session.displayed.get_positions(pane), record.positions[30])
    session.branch()
    advance_session(session, 30)
    for pane, record in zip(session.timeline.panes, records, strict=True):
        np.testing.assert_array_equal(pane.simulation.positions, record.positions[-1])


def test_robots_that_failed_at_different_places_stay_there() -> None:
    before = advance_session(start_session(RAPF, LLOYD), 30)
    before.fail_robot(1)
    records = build_records(advance_session(before, 10))
    session = replayed(*records)
    for pane, other in zip(session.timeline.panes, before.timeline.panes, strict=True):
        assert session.displayed.get_setup(pane).failed == other.setup.failed
    assert session.timeline.panes[0].setup.environment is session.timeline.panes[1].setup.environment


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (lambda record: recorded(steps=5), r"saved/1: moments: expected 61 as in saved/0, got 6"),
        (lambda record: recorded(dt=1 / 50), r"saved/1: dt_s: expected 0.016\d* as in"),
        (lambda record: recorded(robots=3), r"saved/1: team: "),
        (
            lambda record: replace(record, time=record.time**2),
            "saved/1/record.npz: time: expected times 0.0166667 s apart",
        ),
        (
            lambda record: replace(record, team=replace(record.team, radius=np.array([0.1, 0.1, 0.1, 0.2]))),
            "saved/1: team: expected .* as in saved/0, got .*",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(record: Record, other, message: str) -> None:
    with pytest.raises(InputError, match=message):
        replayed(record, other(record))


def test_robots_that_differ_are_as_they_were(record: Record) -> None:
    radius, speeds = np.array([0.1, 0.1, 0.1, 0.2]), np.array([1.0, 0.5, 0.5, 1.0])
    team = replace(record.team, radius=radius, max_speed=speeds)
    session = replayed(replace(record, team=team, gains={**record.gains, "cells": "time"}))
    setup = session.displayed.get_setup(session.timeline.panes[0])
    assert setup.team.to_dict() == team.to_dict()
    seen = session.displayed.get_snapshot(session.timeline.panes[0]).seen
    assert seen.max_speeds is not None
    assert seen.max_speeds.tolist() == [1.0, 0.5, 0.5, 1.0]


def test_more_than_there_is_room_for_is_refused(record: Record) -> None:
    with pytest.raises(InputError, match="saved: 5 runs, but the window has room for 4"):
        replayed(*[record] * 5)


# controllers that are not what they were


def test_a_controller_that_is_not_loaded_leaves_its_run_to_be_looked_at(counting: ControllerChoice) -> None:
    record = recorded(counting)
    session = replayed(record)
    pane = session.timeline.panes[0]
    law = session.displayed.get_setup(pane).controller
    assert isinstance(law, MissingController)
    assert law.label == "Counting"
    for k in (0, 20, STEPS):
        session.show_time(k / 60)
        snapshot = session.displayed.get_snapshot(pane)
        np.testing.assert_array_equal(snapshot.positions, record.positions[k])
        np.testing.assert_array_equal(snapshot.decision.forces, record.forces[k])
        assert snapshot.decision.goals is None
    gone = r"not resumed: Counting is none of .*; to resume it, open it with --controller FILE.py:Counting$"
    with pytest.raises(ParameterError, match=gone):
        session.playback.step()
    session.show_time(0.5)
    for deed in (session.branch, session.restart, lambda: session.fail_robot(1)):
        with pytest.raises(ParameterError, match=gone):
            deed()
    assert (session.timeline.end_time, len(session.timeline.history)) == (1.0, STEPS + 1), "nothing is lost"


def test_at_its_end_another_controller_may_take_over(counting: ControllerChoice) -> None:
    record = recorded(counting)
    session = replayed(record)
    session.show_time(session.timeline.end_time)
    session.set_controller(session.timeline.panes[0], RAPF)
    advance_session(session, 10)
    assert session.timeline.end_time == pytest.approx(1.0 + 10 / 60)


def test_the_window_shows_what_it_can(tmp_path: Path, counting: ControllerChoice) -> None:
    record = recorded(counting)
    opening = Launcher(
        build_replay_session([saved(record)]), "", tmp_path, size=(900, 600), headless=True, lattice=16
    )
    with opening.window() as window:
        for _ in range(40):
            window.frame(1 / 30)
        assert window.viewer.session.timeline.is_live
        assert window.viewer.message.startswith("the record ends here")
        window.do("pause")
        window.frame(1 / 30)
        assert "not resumed" in window.viewer.message
        for tab in ("show", "robot", "parameters"):
            window.panel.show_tab(tab)
            window.do("robot:next")
            window.frame(1 / 30)
            window.frame(1 / 30)


def test_a_controller_that_has_changed_does_not_change_the_past(
    tmp_path: Path, counting: ControllerChoice
) -> None:
    record = recorded(counting)
    (tmp_path / "mine.py").write_text(COUNTING.replace("0.05", "0.5"))
    session = replayed(record, controllers=(counting.name,))
    pane = session.timeline.panes[0]
    session.show_time(0.5)
    np.testing.assert_array_equal(session.displayed.get_snapshot(pane).decision.forces, record.forces[30])
    session.branch()
    assert advance_session(session, 5).timeline.end_time == pytest.approx(0.5 + 5 / 60)


def test_a_controller_remembers_again_what_it_did(counting: ControllerChoice) -> None:
    whole = advance_session(start_session(counting, robots=4), STEPS + 20)
    record = replace(recorded(counting), controller="elsewhere/theirs.py:Counting")
    session = replayed(record, controllers=("lloyd", counting.name))
    session.show_time(0.5)
    session.branch()
    advance_session(session, STEPS + 20 - 30)
    np.testing.assert_array_equal(state_of(session)[0], state_of(whole)[0])


def test_cells_are_of_the_recorded_kind_also_without_the_controller(record: Record) -> None:
    speeds = np.array([1.0, 0.5, 0.5, 1.0])
    team = replace(record.team, max_speed=speeds)
    record = replace(record, controller="theirs.py:Mine", team=team, gains={"cells": "time"})
    session = replayed(record)
    session.show_time(0.5)
    cells = session.displayed.get_snapshot(session.timeline.panes[0]).decision.cells
    assert isinstance(cells, WeightedCells)
    np.testing.assert_array_equal(cells.centroid, record.cells(30).centroid)


def test_gains_that_it_does_not_take_any_more_are_said(record: Record) -> None:
    session = replayed(replace(record, gains={"k_repulsion": 1.0}))
    session.show_time(session.timeline.end_time)
    with pytest.raises(ParameterError, match="unknown gain 'k_repulsion'"):
        session.playback.step()


def test_only_gains_that_differ_are_the_users(record: Record) -> None:
    assert replayed(record).timeline.panes[0].controller == RAPF
    law = ControllerChoice("rapf", {"k_rep": 0.7})
    assert replayed(recorded(law, steps=3)).timeline.panes[0].controller == law


def test_runs_of_any_origin_can_be_looked_at() -> None:
    """Robots that walk through walls end where no simulation can begin; there they are pushed out."""
    record = run_of(HALL, 3, steps=20)
    record = replace(record, team=Team.homogeneous(3))
    assert build_roster(record).numbers == (1, 2, 3)
    session = replayed(record)
    session.show_time(1.0)
    np.testing.assert_array_equal(
        session.displayed.get_positions(session.timeline.panes[0]), record.positions[10]
    )
