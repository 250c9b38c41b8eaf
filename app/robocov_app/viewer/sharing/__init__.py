"""Sharing of a session: as a command, as Python, as a file, or as a link.

- `shared_run`: everything that a run depends on, without the window
- `command_text`, `python_text`: texts that simulate the run
- `values`: numbers in these texts
- `share`: the actions of the share menu
"""
