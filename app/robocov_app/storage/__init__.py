"""User files that the windows write automatically.

- `autosave`: drafts of unsaved work, which survive a crash
- `settings`: appearance of the windows
"""
