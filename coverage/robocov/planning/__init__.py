"""Planning by one robot: its map of the obstacles, routes between them, and goals for robots.

- `raster`, `discovered_map`: square cells, and the occupancy grid that a robot builds from scans
- `scan_log`: the scans that a robot has, and the map that it builds from them
- `openness`: the probability that an unknown cell is free
- `window`, `map_window`, `lattice`, `grid_planner`: distances and routes on a lattice of nodes in the map
- `portals`: connections through passages that a coarse lattice misses
- `team_placement`, `own_goal`: goals of a team, and the goal of one robot
- `viewpoint`: positions from which a robot can look into unknown space
- `voronoi_roadmap`: the generalized Voronoi graph of a map
"""
