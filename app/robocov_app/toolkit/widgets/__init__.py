"""Widgets, as functions that take a page; one module for each kind.

- `appearance`: shared drawing functions: boxes, button faces, the focus ring, texts
- `labels`, `buttons`, `sections`: texts; buttons, options, tabs and check boxes; collapsible sections
- `icon_buttons`, `icons`: buttons with icons, and the strokes of the icons
- `slider`, `text_field`, `dropdown`: widgets that edit a value
- `scroll_area`: areas with a scroll bar
"""
