"""Files of sessions.

- `session_file`: session files, ``NAME.robocov``
- `models`, `fields`, `maps`: the format of these files
- `workspace`: the file and the drafts of the open session
- `drafts`: drafts that earlier windows left behind
- `run_saver`: saves the runs of a session in the background
"""
