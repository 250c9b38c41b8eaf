from dataclasses import replace

import pytest

from robocov.environment import CircleObstacle, DiscStart, Environment, WallObstacle
from robocov.mapfile.check import check_map
from robocov_app.commands.maps.check import report_lines


@pytest.fixture
def hall() -> Environment:
    square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    return Environment("hall", square, (), {"corner": DiscStart((1.0, 1.0), 0.5)})


def told(after: Environment, before: Environment | None = None) -> dict[str, str]:
    lines = report_lines(check_map(after), None if before is None else check_map(before))
    pairs = [line.strip().split("  ", 1) for line in lines]
    assert len({title for title, _ in pairs}) == len(pairs)
    return {title: value.strip() for title, value in pairs}


def test_a_report_has_every_figure(hall: Environment) -> None:
    assert told(hall) == {
        "name": "hall",
        "area": "100 m²",
        "free area": "100 m² (100.0%)",
        "obstacles": "0, with 4 vertices (boundary included)",
        "components": "1 (100 m²)",
        "narrowest gap": "none",
        "start corner": "disc, room for about 23",
    }


def test_what_is_as_it_was_is_told_without_a_word(hall: Environment) -> None:
    assert told(hall, hall) == told(hall)


def test_what_has_changed_is_told_with_what_it_was(hall: Environment) -> None:
    wall = WallObstacle(((4.0, 0.0), (4.0, 9.9)), 0.5)
    after = told(replace(hall, obstacles=(wall,), starts={"all": DiscStart((1.0, 1.0), 0.5)}), hall)
    assert after["free area"] == "95.05 m² (95.1%), was 100 m² (100.0%)"
    assert after["narrowest gap"].startswith("0.100 m, between [") and after["narrowest gap"].endswith(
        ", was none"
    )
    assert after["start all"] == "disc, room for about 23, was none"
    assert after["start corner"] == "none, was disc, room for about 23"
    assert after["warning"].endswith("does not pass (new)")
    assert after["name"] == "hall"


def test_a_warning_that_is_gone_is_told(hall: Environment) -> None:
    outside = replace(hall, obstacles=(CircleObstacle((20.0, 2.0), 0.5),))
    assert told(outside)["warning"] == "obstacles[0] is entirely outside the boundary"
    assert told(outside, outside)["warning"] == "obstacles[0] is entirely outside the boundary"
    assert told(hall, outside)["no longer"] == "obstacles[0] is entirely outside the boundary"
    assert "warning" not in told(hall, outside)


def test_of_many_components_the_largest_are_told(hall: Environment) -> None:
    walls = tuple(WallObstacle(((x, 0.0), (x, 10.0)), 0.5) for x in (1.0, 2.5, 4.0, 5.5, 7.0, 8.5))
    (line,) = (
        line
        for line in report_lines(check_map(replace(hall, obstacles=walls)))
        if line.startswith("  components")
    )
    assert line.endswith("7 (12.5 m², 10 m², 10 m², 10 m², 10 m², ...)")
