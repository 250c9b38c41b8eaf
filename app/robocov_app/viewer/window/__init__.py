"""The viewer's window: its loop, mouse, dialogs, status line and video."""
