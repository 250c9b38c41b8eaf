"""Controllers that place the whole team on the known map, and then move to their goals.

- `local_search`: `LocalSearch`, single moves of robots until none lowers the cost
- `exemplar`: `Exemplar`, greedy choice of positions
- `placement_controller`: the base class of both, and the points of a map at which robots can be placed
"""
