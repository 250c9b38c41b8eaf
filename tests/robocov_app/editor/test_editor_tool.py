"""Directions, lengths and positions that tools share."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import ObstaclePath, UniformStart
from robocov_app.editor.edits.create import find_free_name
from robocov_app.editor.edits.paths import describe_path
from robocov_app.editor.edits.transform import Affine
from robocov_app.editor.model import geometry
from robocov_app.editor.model.geometry import (
    distance,
    format_bearing,
    format_length,
)
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import format_position, translate_message
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.geometry import SHIFT_ANGLE_DEG, compute_cos_sin, constrain_angle

NUMBERS = st.floats(-100, 100).map(lambda value: round(value, 3))
POINTS = st.tuples(NUMBERS, NUMBERS)


@given(POINTS, POINTS)
def test_a_straightened_line_has_a_round_angle_and_is_the_nearest_such(origin, point) -> None:
    to = constrain_angle(origin, point)
    if distance(origin, to) > 1e-3:
        angle = np.degrees(np.arctan2(to[1] - origin[1], to[0] - origin[0]))
        assert abs(angle / SHIFT_ANGLE_DEG - round(angle / SHIFT_ANGLE_DEG)) < 1e-3
    # No other ray at a multiple of the angle is nearer.
    directions = np.radians(np.arange(0, 180, SHIFT_ANGLE_DEG))
    across = np.abs(
        (point[0] - origin[0]) * np.sin(directions) - (point[1] - origin[1]) * np.cos(directions)
    ).min()
    assert distance(point, to) <= across + 1e-6


def test_shift_holds_the_angle_and_nothing_else_does() -> None:
    aim = EditorPointerEvent((3.0, 0.2), (3.0, 0.1), 0.1)
    assert aim.constrain((0.0, 0.0)) == (3.0, 0.2)
    shifted = EditorPointerEvent((3.0, 0.2), (3.0, 0.1), 0.1, shift=True)
    assert shifted.constrain((0.0, 0.0)) == (3.0, 0.0)
    assert shifted.constrain(None) == (3.0, 0.2)


def test_lengths_and_angles_are_formatted() -> None:
    assert format_bearing((0, 0), (-1, 0)) == "1.00 m  ∠ 180°"
    assert format_bearing((0, 0), (1, 1)) == "1.41 m  ∠ 45°"
    assert format_bearing((0, 0), (1, -1e-9)) == "1.00 m  ∠ 0°"
    assert format_length(0.05) == "5.0 cm"
    assert (format_length(12.3456), format_length(1234.5)) == ("12.35 m", "1234.5 m")
    assert (geometry.format_point((1.0, -0.001)), format_position(1.25, 0.0)) == (
        "(1.00, 0.00) m",
        "(1.25, 0)",
    )
    assert format_position(385123.25, 5819000.0625) == "(385123.25, 5819000.062)"
    assert describe_path(ObstaclePath(((0.0, 0.0), (3.0, 0.0)), 0.5)) == "0.5 m/s, loop of 6 m in 12 s"
    assert find_free_name(Sketch(starts=(("start", UniformStart()),)), "start") == "start 2"
    assert translate_message('map: starts["a b"].positions[1]: x', Sketch()) == "start “a b”, position 2: x"


def test_points_and_angles_are_exact_where_they_are_round() -> None:
    assert (geometry.round_point((0.1 + 0.2, -0.00001)), geometry.round_length(2 / 3)) == ((0.3, 0.0), 0.6667)
    ring = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)]
    assert geometry.drop_repeated_points(ring) == ((0.0, 0.0), (1.0, 0.0))
    assert compute_cos_sin(-90.0) == (0.0, -1.0)
    assert geometry.compute_leveling_angle((1.0, 1.0), (1.0, 3.0)) == 0.0
    assert geometry.compute_leveling_angle((0.0, 0.0), (1.0, 1.0)) == -45.0
    assert constrain_angle((0.0, 0.0), (3.0, 0.1)) == (3.0, 0.0)
    assert Affine.rotation(90.0, about=(1.0, 0.0)).transform_points([(2.0, 0.0)]) == ((1.0, 1.0),)


def test_a_plain_tool_does_nothing() -> None:
    tool = EditorTool()
    assert not tool.is_busy and tool.origin is None and tool.snap_points == ()
    assert tool.finish(None) is None and not tool.remove_last(None) and not tool.cancel(None)
    assert tool.build_overlay(None) == EditorToolOverlay()
