"""Controllers that explore: they build a map of the region while they cover it.

- `atlas`: `Atlas`, in which each robot plans on its own map, and `AtlasShared`, with a common map
- `frontier_median`, `greedy_submodular`, `voronoi_graph`: other planners on a common map
- `exploring_lloyd`: Lloyd's algorithm for a density that is measured on the way
- `shared_map`: the base of the controllers with a common map, their groups and plans
- `scan_exchange`: the messages from which robots with a common map build it
- `sightings`: messages with the last known positions of robots
- `teammates`: what a robot with its own map assumes about the others
- `localization`: estimated positions from noisy measurements
- `atlas_memory`: what robots with `Atlas` remember from one plan to the next
- `route_following`: forces along planned routes
"""
