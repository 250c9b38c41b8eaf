"""The session of the window: edits, timeline, playback and files. Without pygame.

- `session`: every edit that users can make
- `document`, `edits`, `map_edits`: the tree of edits from which every state can be recomputed
- `timeline`, `present`, `displayed`: the present, the branches, and the displayed state
- `pane`, `lockstep`: a team under one controller, and panes that advance together
- `drag_spring`: the spring with which the pointer pulls a robot
- `past`: recorded states, trajectories and cost curves
- `scenario`, `controller_choice`, `robot_properties`: one map and team under up to four controllers
- `playback`, `clock`: how time passes
- `files`: session files and drafts
- `recorded`, `missing_controller`: sessions whose past is a saved run
- `save_points`: states to which a session returns after an unexpected error
- `passages`: effects of an edit of the map on passages
"""
