"""Layers of a picture: each shows one aspect of a scene.

Modules
-------
layer
    `Layer`, and the entries that layers have in the legend.
cells, static_map
    Voronoi cells; grid, obstacles and boundary.
density, distances
    Heat maps: the density, distances to the nearest robot and geodesic cells.
robots, marks
    Robots, also failed and selected ones; starts, goals and centroids.
arrows, perception
    Force terms and velocities; ranges, neighbors and nearest obstacle points.
ray_scans, known_obstacles
    Measurements of range sensors, and the obstacles that robots know.
trajectories, fading_trails, cursor_path
    Trajectories, and the shortest path from the cursor to its nearest robot.
"""
