import numpy as np
import pytest
import shapely

from robocov.environment import CircleObstacle, DiscStart, Environment, PolygonObstacle
from robocov.errors import StartError
from robocov.mapfile import bundled_maps, load_map
from robocov_app.replication import maps


@pytest.mark.parametrize("name", [*maps.NON_CONVEX, *maps.CONVEX])
def test_every_kind_of_start_has_room_on_every_map(name):
    environment = maps.with_kinds_of_starts(load_map(name), maps.CONVEX_KINDS)
    assert tuple(environment.starts) == maps.CONVEX_KINDS
    for kind, spec in environment.starts.items():
        assert environment.start(kind).sample(6, seed=1).shape == (6, 2)
        if isinstance(spec, DiscStart):
            disc = shapely.Point(spec.center).buffer(spec.radius - 0.01)
            assert environment.free.contains(disc)


def test_the_maps_are_all_but_one_of_those_that_are_not_convex():
    convex = {name for name in bundled_maps() if load_map(name).blocked.is_empty}
    assert convex == set(maps.CONVEX)
    assert set(bundled_maps()) - convex - set(maps.NON_CONVEX) == {"campus", "forklifts", "hospital"}


def test_clustered_starts_are_as_near_as_can_be():
    ring = ((0, 0), (8, 0), (8, 6), (0, 6))
    pillar = Environment("pillar", ring, (CircleObstacle((4.0, 3.0), 1.0),))
    starts = maps.with_kinds_of_starts(pillar).starts
    assert starts["corner"] == DiscStart((0.8, 0.8), 0.8)
    centre = starts["centre"]
    assert isinstance(centre, DiscStart)
    assert np.hypot(centre.center[0] - 4.0, centre.center[1] - 3.0) == pytest.approx(1.8, abs=0.02)


def test_narrow_maps_get_smaller_discs_and_too_narrow_ones_none():
    for width, radius in ((1.3, 0.6), (1.0, 0.45)):
        alley = Environment("alley", ((0, 0), (9, 0), (9, width), (0, width)))
        spec = maps.with_kinds_of_starts(alley).starts["corner"]
        assert isinstance(spec, DiscStart)
        assert spec.radius == radius
    block = PolygonObstacle(((0.5, 0.5), (8.5, 0.5), (8.5, 8.5), (0.5, 8.5)))
    ring = Environment("ring", ((0, 0), (9, 0), (9, 9), (0, 9)), (block,))
    with pytest.raises(StartError, match=r"map 'ring': no free disc of 0\.45 m radius"):
        maps.with_kinds_of_starts(ring)


@pytest.mark.parametrize("seed", range(12))
def test_convex_regions_are_convex_large_and_the_same_every_time(seed):
    region = maps.convex_region(seed)
    polygon = region.boundary_polygon
    assert polygon.is_valid and polygon.equals(polygon.convex_hull)
    assert polygon.area >= 40.0
    assert region.blocked.is_empty
    assert region == maps.convex_region(seed)
    assert region.boundary != maps.convex_region(seed + 1).boundary
    # no strip: a disc of nearly two metres fits
    assert not polygon.buffer(-1.8).is_empty


def test_a_share_is_a_square():
    assert maps.side_of_share(load_map("square"), 4) == pytest.approx(5.0)
