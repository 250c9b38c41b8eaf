"""Toolkit of both windows; it knows no robots and no maps."""
