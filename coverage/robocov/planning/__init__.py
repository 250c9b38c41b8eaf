"""Planning by one robot: its map of the obstacles, routes among them, and positions for robots.

- `raster`, `discovered_map`: square cells, and the occupancy grid that a robot builds from its scans
- `openness`: how likely an unknown cell is free
- `window`, `lattice`, `grid_planner`: distances and routes on a lattice of nodes in a discovered map
- `team_placement`, `own_goal`, `viewpoint`: goals of a team, of one robot, and where to look around
- `voronoi_roadmap`: the generalized Voronoi graph of a map
"""
