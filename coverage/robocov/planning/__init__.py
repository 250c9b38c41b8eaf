"""Planning by one robot: its map of the obstacles, routes between them, and goals for robots.

- `raster`, `discovered_map`: square cells, and the occupancy grid that a robot builds from scans
- `scan_log`, `scan_areas`: the scans that a robot has, the map that it builds from them, and the cells that a
  scan can change
- `openness`: the probability that an unknown cell is free
- `window`, `map_window`: the cells of the map in a window, and a lattice of nodes
- `lattice`, `portals`, `lattice_graph`: the edges between the nodes, and the shortest distances along them
- `node_visibility`: lines of sight, and the nodes that are visible from a position
- `routes`, `goal_candidates`: routes of robots, and the nodes that may become goals
- `grid_planner`: all of these for one window, shared by the robots that share a map
- `team_placement`, `own_goal`: goals of a team, and the goal of one robot
- `viewpoint`: positions from which a robot can look into unknown space, and how much this can be worth
- `voronoi_roadmap`: the generalized Voronoi graph of a map
"""
