"""The recorded past of a session.

- `states`, `history`: recorded states from which a run can be resumed
- `decision_replay`: observations and decisions of the past, recomputed from recorded states
- `trails`: trajectories of the robots
- `curves`, `ghosts`: cost curves of the displayed branch, and of other branches
"""
