"""Small images of maps and runs."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from drawn_run import HALL, ROOMS
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from reported_results import HOSTILE, build_history, build_record

from robocov.conditions import Conditions
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.metrics import CostHistory
from robocov_app.report.pictures import MAX_ROBOTS, PictureFrame, _format_path, draw_map, draw_run


def parse_svg(svg: str) -> ElementTree.Element:
    return ElementTree.fromstring(svg)


def find_class(root: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    return [each for each in root if name in each.get("class", "").split()]


@given(arrays(float, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(-500, 500)))
def test_relative_steps_of_a_path_add_up(points) -> None:
    matches = re.findall(r"-?[\d.]+(?:e-?\d+)?", _format_path([points]))
    numbers = np.array([float(match) for match in matches])
    if "h0" in _format_path([points]):
        numbers = numbers[:-1]
    visited = np.cumsum(numbers.reshape(-1, 2), axis=0)
    assert np.abs(visited[0] - points[0]).max() <= 0.051
    assert np.abs(visited[-1] - points[-1]).max() <= 0.051 + 1e-6


def test_failed_robots_are_crossed_out_and_absent_robots_are_not_drawn() -> None:
    record = build_record(robots=5)
    conditions = Conditions(failures=((2, 2.0),), joins=((4, 3.0), (5, 99.0)))
    svg = draw_run(replace(record, conditions=conditions), None, has_numbers=True)
    root = parse_svg(svg)
    assert [each.text for each in root.iter() if each.tag.endswith("text")] == ["1", "3", "4"]
    assert len(find_class(root, "robot")) == 3
    assert [each.tag.rpartition("}")[2] for each in find_class(root, "failed")] == ["circle", "path"]
    assert len(find_class(root, "start")) == 4
    (trajectories,) = find_class(root, "trajectory")
    assert trajectories.attrib["d"].count("M") == 4
    assert "Robot 2 fails at 2.0 s, robot 4 joins at 3.0 s." in svg
    assert "fails" not in draw_run(record, None)


def test_robots_are_drawn_at_their_final_positions() -> None:
    record = build_record(robots=5)
    root = parse_svg(draw_run(record, build_history(record, 2.0), 400, 300, has_numbers=True))
    frame = PictureFrame(ROOMS, 400, 300)
    positions = np.array(
        [[float(each.get("cx")), float(each.get("cy"))] for each in find_class(root, "robot")]
    )
    assert positions == pytest.approx(frame.to_pixels(record.positions[-1]), abs=0.06)
    starts = np.array([[float(each.get("cx")), float(each.get("cy"))] for each in find_class(root, "start")])
    assert starts == pytest.approx(frame.to_pixels(record.positions[0]), abs=0.06)
    assert [each.text for each in root if each.tag == "text"] == ["1", "2", "3", "4", "5"]
    assert len(find_class(root, "cell")) == 5
    assert find_class(root, "trajectory")[0].get("d").count("M") == 5


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda each: each.name)
@pytest.mark.parametrize("size", [(300.0, 200.0), (200.0, 300.0)])
def test_a_map_fits_into_its_image(environment, size) -> None:
    frame = PictureFrame(environment, *size)
    points = frame.to_pixels(environment.region.vertices)
    assert (points >= 2.9).all()
    assert (points <= np.array([frame.width, frame.height]) - 2.9).all()
    assert frame.width == pytest.approx(size[0], abs=0.1) or frame.height == pytest.approx(size[1], abs=0.1)
    root = parse_svg(draw_map(environment, *size))
    assert root.get("viewBox") == f"0 0 {frame.width:g} {frame.height:g}"
    assert find_class(root, "blocked")
    assert find_class(root, "region")


def test_every_image_has_a_description() -> None:
    record = build_record()
    description = parse_svg(draw_run(record, build_history(record, 2.345))).get("aria-label")
    assert description == (
        "RAPF on map rooms: trajectories of 4 robots from start spread over 6 s. "
        "The mean distance to the nearest robot falls from 6.000 m to 2.345 m."
    )
    assert "cost" not in parse_svg(draw_run(record, None)).get("aria-label")
    assert parse_svg(draw_map(HALL)).get("aria-label") == (
        "Map hall: 14 m by 11 m without obstacles, 98 m² free, 22% of the known region blocked."
    )
    hidden = parse_svg(draw_run(record, None, is_hidden=True))
    assert hidden.get("aria-hidden") == "true"
    assert hidden.get("aria-label") is None


@pytest.mark.parametrize(
    ("first", "final", "change"),
    [
        (0.50003, 0.50001, "stays at 0.500 m"),
        (0.5, 0.499, "falls from 0.500 m to 0.499 m"),
        (0.5, 0.501, "rises from 0.500 m to 0.501 m"),
    ],
)
def test_the_described_change_agrees_with_the_rounded_costs(first, final, change) -> None:
    costs = np.array([first, final])
    history = CostHistory(np.array([0.0, 6.0]), costs, costs, 0.0 * costs, costs)
    description = parse_svg(draw_run(build_record(), history)).get("aria-label")
    assert f"The mean distance to the nearest robot {change}." in description
    arrival = f"The mean travel time of the first robot to arrive {change.replace(' m', ' s')}."
    assert description.endswith(arrival)


def test_names_are_escaped() -> None:
    record = build_record(replace(ROOMS, name=HOSTILE), label=HOSTILE)
    root = parse_svg(draw_run(record, None))  # Unescaped names would be invalid XML.
    assert HOSTILE in root.get("aria-label")
    assert not [each for each in root.iter() if each.tag in ("img", "script")]


def test_a_record_of_two_steps_has_no_trajectories() -> None:
    record = build_record()
    names = ("time", "positions", "goals")
    ends = replace(record, **{name: getattr(record, name)[[0, -1]] for name in names})
    root = parse_svg(draw_run(ends, None))
    assert not find_class(root, "trajectory")
    assert find_class(root, "robot")


def test_large_teams_are_drawn_without_cells_and_trajectories() -> None:
    record = build_record(robots=MAX_ROBOTS + 1, hz=2.0)
    root = parse_svg(draw_run(record, None))
    assert not find_class(root, "cell")
    assert not find_class(root, "trajectory")
    assert len(find_class(root, "robot")) == MAX_ROBOTS + 1


def test_moving_obstacles_are_drawn_with_their_motion() -> None:
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    plain = draw_map(ROOMS)
    assert "moving" not in plain
    moving = draw_map(replace(ROOMS, obstacles=(cart,)))
    assert all(f'class="{each}"' in moving for each in ("blocked moving", "motion", "heading"))
    assert "with one obstacle (1 moving)" in moving
