"""Generated plans of rooms: doors, corridors and rooms that are too small."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from robocov.generator.request import MapRequest
from robocov.generator.rooms import sample_floor_plan

THICKNESS = 0.1


def list_rooms_reached_from_the_first(plan):
    """Return the indices of the rooms that doors connect to the first one."""
    reached = {0}
    for _ in plan.rooms:
        for door in plan.doors:
            if reached & set(door.rooms):
                reached.update(door.rooms)
    return reached


@given(st.integers(0, 2**32), st.integers(1, 30), st.floats(0.3, 0.8), st.sampled_from([10, 15.5, 24.0]))
def test_rooms_tile_the_plan_and_doors_join_them(seed, count, gap, width):
    request = MapRequest(count, 0.1, gap, width, 12.0)
    plan = sample_floor_plan(request, THICKNESS, np.random.default_rng(seed))
    assume(plan is not None)
    rooms = [shapely.box(*room) for room in plan.rooms]
    assert len(rooms) == count
    assert sum(room.area for room in rooms) == pytest.approx(width * 12.0)
    assert shapely.union_all(rooms).area == pytest.approx(width * 12.0)
    # A disc as wide as the gap fits into every room without its walls.
    assert all(min(room.sides) - THICKNESS >= gap for room in plan.rooms)

    assert len(list_rooms_reached_from_the_first(plan)) == count

    solid = shapely.union_all([wall.polygon for wall in plan.build_walls()])
    for door in plan.doors:
        assert door.end - door.start >= gap
        opening = door.wall.build_section(door.start, door.end, THICKNESS).polygon
        assert opening.area == pytest.approx((door.end - door.start) * THICKNESS)
        assert opening.intersection(solid).area < 1e-9
        # Half of the opening lies in each of the two rooms.
        first, second = door.rooms
        assert opening.intersection(rooms[first]).area == pytest.approx(opening.area / 2)
        assert opening.intersection(rooms[second]).area == pytest.approx(opening.area / 2)
    # Only doors connect the rooms.
    openings = [
        door.wall.build_section(door.start, door.end, THICKNESS).polygon.buffer(1e-9) for door in plan.doors
    ]
    closed = shapely.box(0, 0, width, 12) - shapely.union_all([solid.buffer(1e-9), *openings])
    assert len(shapely.get_parts(closed)) == count


def test_about_half_of_the_plans_have_a_corridor():
    request = MapRequest(8, 0.1, 0.6, 12.0, 10.0)
    plans = [sample_floor_plan(request, THICKNESS, np.random.default_rng(seed)) for seed in range(60)]
    has_corridor = [
        any(room.sides[0] == 12.0 and room.sides[1] < 1.6 for room in plan.rooms)
        for plan in plans
        if plan is not None
    ]
    assert len(has_corridor) > 50
    assert 0.25 < np.mean(has_corridor) < 0.75


def test_there_is_no_plan_if_rooms_would_be_too_small():
    assert (
        sample_floor_plan(MapRequest(60, 0.1, 1.0, 10.0, 10.0), THICKNESS, np.random.default_rng(0)) is None
    )
