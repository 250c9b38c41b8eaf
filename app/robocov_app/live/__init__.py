"""What goes on beside the window: the exact cost in a process of its own."""
