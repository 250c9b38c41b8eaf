"""The session of the window: edits, timeline, playback and files. Without pygame."""
