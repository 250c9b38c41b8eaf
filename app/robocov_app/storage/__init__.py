"""Files of the user that the windows write by themselves.

- `autosave`: drafts of unsaved work, which survive a crash
- `settings`: appearance of the windows
"""
