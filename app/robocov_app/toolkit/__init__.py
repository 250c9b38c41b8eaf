"""What both windows are built with; it knows no robots and no maps."""
