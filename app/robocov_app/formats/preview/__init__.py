"""Figures of imports: `layout` of the page, and `plotting` of the map before and after its conversion."""

from robocov_app.formats.preview.plotting import plot_import, save_preview

__all__ = ["plot_import", "save_preview"]
