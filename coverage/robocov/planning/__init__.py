"""Planning by one robot: its map of the obstacles, routes between them, and goals for robots.

- `raster`, `discovered_map`: square cells, and the occupancy grid that a robot builds from its scans
- `openness`: the probability that an unknown cell is free
- `window`, `map_window`, `lattice`, `grid_planner`: distances and routes on a lattice of nodes in the map
- `team_placement`, `own_goal`, `viewpoint`: goals of a team, the goal of one robot, and where to look around
- `voronoi_roadmap`: the generalized Voronoi graph of a map
"""
