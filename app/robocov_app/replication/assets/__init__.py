"""Templates, styles, captions, gain grids and profiles of controllers."""

from pathlib import Path

ASSETS = Path(__file__).parent
"""Folder of these files."""
