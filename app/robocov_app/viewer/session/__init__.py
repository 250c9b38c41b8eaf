"""The session of the window: edits, timeline, playback and files; independent of pygame.

- `session`: all edits that users can make
- `document`, `edits`, `map_edits`: the tree of edits from which every state can be recomputed
- `timeline`, `present`, `seek`, `displayed`: the present, the branches, and the displayed state
- `pane`, `pane_group`: a team under one controller, and panes that advance together
- `drag_spring`: the spring with which the pointer pulls a robot
- `past`: recorded states, trajectories and cost curves
- `scenario`, `controller_choice`, `robot_properties`: one map and team under up to four controllers
- `playback`, `clock`: how simulated time advances with real time
- `files`: session files and drafts
- `recorded`, `missing_controller`: sessions whose past is a saved run
- `save_points`: states that are restored after an unexpected error
- `passages`: effects of a map edit on passages
"""
