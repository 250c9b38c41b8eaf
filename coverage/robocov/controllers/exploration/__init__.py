"""Controllers that explore: they build a map of the region while they cover it.

Controllers:

- `atlas`: `Atlas`, in which each robot plans on its own map
- `atlas_shared`: `AtlasShared`, the same with maps that the robots share
- `frontier_median`, `greedy_submodular`, `voronoi_graph`: other planners on shared maps
- `exploring_lloyd`: Lloyd's algorithm for a density that robots measure while they move

Parts of `Atlas`:

- `atlas_memory`: data that robots remember from one plan to the next
- `team_knowledge`, `teammates`: knowledge of a robot about the others
- `team_goals`: goals for all robots of the team
- `jams`, `staggering`: robots that block each other, and times that differ from robot to robot
- `localization`: positions estimated from noisy or late measurements

Part of `FrontierMedian`:

- `visits`: visits of robots to targets on frontiers

Parts of several controllers:

- `shared_map`: the base class of controllers with shared maps
- `scan_exchange`: the messages from which robots build a shared map
- `sightings`: messages with the last known positions of robots
- `route_following`: forces along planned routes
"""
