"""The session of the window: edits, timeline, playback and files; independent of pygame.

- `session`: all edits that users can make
- `document`: the tree of edits from which every state can be recomputed
- `editing`: edits and their effects on the map, the spring with which the pointer pulls a robot
- `setup`: one map and team under up to four controllers
- `timeline`, `present`, `seek`, `displayed`: the present, the branches, and the displayed state
- `pane`, `pane_group`: a team under one controller, and panes that advance together
- `past`: recorded states, trajectories and cost curves
- `playback`, `clock`: how simulated time advances with real time
- `files`: session files and drafts
- `recorded`: sessions whose past is a saved run
- `save_points`: states that are restored after an unexpected error
"""
