"""Measure how much longer the paths of a disc are than those of a point, on maps of the benchmark.

    python tests/bench/bench_disc_distances.py

Distances in the coverage cost are those of points, which pass through no gap that is narrower than a robot.
The center of a disc has to keep its radius from walls. This script computes its distances in the free space
without the points that are closer to a wall than the radius; arcs around corners are replaced by chords. Both
mean distances are averages over the sites that the center of a disc can reach. The robots are at the
positions of the reference placement, or at the nearest ones that the center of a disc can reach.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import shapely

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic import Geodesics
from robocov.typing import FloatArray, Point
from robocov_app.benchmark.suite import TRACKS, load_frozen_maps, load_suite_map

EDGES_PER_QUARTER = 8
"""Edges per quarter circle around a corner. Their length deviates from that of the arc by 0.2%."""
MIN_CLEARANCE_M = 1e-3
"""Minimum distance of sites from the walls of the eroded free space."""
ROUNDING_M = 1e-9
"""Distance by which a start may be outside the eroded free space because of rounding."""


def list_vertices(ring: shapely.LinearRing) -> tuple[Point, ...]:
    """Return the vertices of a ring, each once."""
    return tuple((x, y) for x, y in shapely.get_coordinates(ring)[:-1].tolist())


def build_eroded_map(part: shapely.Polygon) -> Environment:
    """Build a map whose free space is a part of the positions that the center of a disc can reach."""
    obstacles = tuple(PolygonObstacle(list_vertices(ring)) for ring in part.interiors)
    return Environment("eroded", list_vertices(part.exterior), obstacles)


def build_sites(area: shapely.Geometry, lattice: int) -> FloatArray:
    """Return the centers of lattice cells that are in an area, (m, 2) m."""
    low_x, low_y, high_x, high_y = area.bounds
    spacing = max(high_x - low_x, high_y - low_y) / lattice
    centers = spacing * (np.arange(lattice) + 0.5)
    x, y = np.meshgrid(low_x + centers, low_y + centers)
    points = np.column_stack([x.ravel(), y.ravel()])
    sites: FloatArray = points[shapely.intersects_xy(area, *points.T)]
    return sites


def compute_relative_excess(
    environment: Environment, positions: FloatArray, radius: float, lattice: int
) -> float:
    """Return by which fraction the mean distance of discs is longer than that of points."""
    eroded = environment.free.buffer(-radius, quad_segs=EDGES_PER_QUARTER)
    sites = build_sites(eroded.buffer(-MIN_CLEARANCE_M), lattice)
    # The reference placement may contain positions that are closer to a wall than the radius.
    lines = shapely.shortest_line(eroded, shapely.points(positions))
    starts = shapely.get_coordinates(shapely.get_point(lines, 0))
    disc_distances = np.full(len(sites), np.inf)
    for part in shapely.get_parts(eroded):
        is_start = shapely.dwithin(part, shapely.points(starts), ROUNDING_M)
        is_site = shapely.intersects_xy(part, *sites.T)
        if is_start.any() and is_site.any():
            geodesics = Geodesics(build_eroded_map(part))
            distances = geodesics.compute_distances(starts[is_start], sites[is_site])
            disc_distances[is_site] = distances.min(axis=0)
    geodesics = Geodesics(environment.close_gaps(radius))
    point_distances = geodesics.compute_distances(starts, sites).min(axis=0)
    is_reached = np.isfinite(disc_distances)
    return float(disc_distances[is_reached].mean() / point_distances[is_reached].mean() - 1.0)


def get_reference_positions(frozen_map: Mapping[str, Any], robots: int) -> FloatArray:
    """Return the reference placement of a map for a number of robots, (n, 2) m."""
    return np.array(frozen_map["references"][str(robots)]["positions_m"])


def main() -> None:
    """Print the relative excess of the mean distance on each map of a track, and the largest one."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--track", default="ideal", help="track whose maps are used (default: %(default)s)")
    parser.add_argument("--robots", type=int, default=6, help="number of robots (default: %(default)s)")
    parser.add_argument("--lattice", type=int, default=64, help="cells along a side (default: %(default)s)")
    parser.add_argument(
        "--radius", type=float, default=DEFAULT_RADIUS_M, help="radius of a robot, m (default: %(default)s)"
    )
    arguments = parser.parse_args()
    frozen_maps = load_frozen_maps()
    excesses = []
    for name in TRACKS[arguments.track].maps:
        positions = get_reference_positions(frozen_maps[name], arguments.robots)
        environment = load_suite_map(name)
        excesses.append(compute_relative_excess(environment, positions, arguments.radius, arguments.lattice))
        print(f"{name:24} {excesses[-1]:7.2%}", flush=True)
    print(f"{len(excesses)} maps: median {np.median(excesses):.2%}, largest {max(excesses):.2%}")
    print(f"CPU time {time.process_time():.0f} s")


if __name__ == "__main__":
    main()
