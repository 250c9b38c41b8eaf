"""Files of the user that the windows keep by themselves.

- `autosave`: drafts of work that is not saved, which survive a crash
- `settings`: the look of the windows
"""
