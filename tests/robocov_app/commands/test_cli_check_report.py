"""`robocov check` with a report: measures, and differences from an earlier report."""

from dataclasses import replace

import pytest

from robocov.environment import CircleObstacle, DiscStart, Environment, WallObstacle
from robocov.mapfile.check import check_map
from robocov_app.commands.maps.check import format_report


@pytest.fixture
def hall() -> Environment:
    square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    return Environment("hall", square, (), {"corner": DiscStart((1.0, 1.0), 0.5)})


def read_report(after: Environment, before: Environment | None = None) -> dict[str, str]:
    """Return the values of a report by their titles."""
    lines = format_report(check_map(after), None if before is None else check_map(before))
    pairs = [line.strip().split("  ", 1) for line in lines]
    assert len({title for title, _ in pairs}) == len(pairs)
    return {title: value.strip() for title, value in pairs}


def test_a_report_contains_every_measure(hall: Environment) -> None:
    assert read_report(hall) == {
        "name": "hall",
        "area": "100 m²",
        "free area": "100 m² (100.0%)",
        "obstacles": "0 separate obstacles, walls are part of the boundary; 4 vertices (boundary included)",
        "components": "1 (100 m²)",
        "unreachable": "none, for robots of radius 0.1 m",
        "narrowest passage": "none",
        'start "corner"': "disc, space for about 23 robots",
    }


def test_an_unchanged_report_has_no_marks(hall: Environment) -> None:
    assert read_report(hall, hall) == read_report(hall)


def test_changed_values_are_printed_with_previous_values(hall: Environment) -> None:
    wall = WallObstacle(((4.0, 0.0), (4.0, 9.9)), 0.5)
    after = read_report(replace(hall, obstacles=(wall,), starts={"all": DiscStart((1.0, 1.0), 0.5)}), hall)
    assert after["free area"] == "95.05 m² (95.1%), was 100 m² (100.0%)"
    assert after["narrowest passage"].startswith("0.100 m, between [")
    assert after["narrowest passage"].endswith(", was none")
    assert after['start "all"'] == "disc, space for about 23 robots, was none"
    assert after['start "corner"'] == "none, was disc, space for about 23 robots"
    assert after["warning"].endswith("cannot pass (new)")
    assert after["name"] == "hall"


def test_a_warning_that_disappears_is_marked(hall: Environment) -> None:
    outside = replace(hall, obstacles=(CircleObstacle((20.0, 2.0), 0.5),))
    assert read_report(outside)["warning"] == "obstacles[0] is entirely outside the boundary"
    assert read_report(outside, outside)["warning"] == "obstacles[0] is entirely outside the boundary"
    assert read_report(hall, outside)["no longer"] == "obstacles[0] is entirely outside the boundary"
    assert "warning" not in read_report(hall, outside)


def test_only_the_largest_components_are_listed(hall: Environment) -> None:
    walls = tuple(WallObstacle(((x, 0.0), (x, 10.0)), 0.5) for x in (1.0, 2.5, 4.0, 5.5, 7.0, 8.5))
    (line,) = (
        line
        for line in format_report(check_map(replace(hall, obstacles=walls)))
        if line.startswith("  components")
    )
    assert line.endswith("7 (12.5 m², 10 m², 10 m², 10 m², 10 m², ...)")


def test_space_behind_a_narrow_gap_is_unreachable(hall: Environment) -> None:
    wall = WallObstacle(((8.0, 0.1), (8.0, 10.0)), 0.2)
    rows = read_report(replace(hall, obstacles=(wall,)))
    assert rows["components"].startswith("1 (")
    assert rows["unreachable"] == "19.02 m² (19.4% of the free area), for robots of radius 0.1 m"
