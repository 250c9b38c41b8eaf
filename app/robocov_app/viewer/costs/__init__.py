"""The coverage cost of the panes, computed in another process."""
