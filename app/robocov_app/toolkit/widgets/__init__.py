"""Widgets: functions of a page, one module for each family.

- `appearance`: what widgets have in common: boxes, faces, the focus ring, texts
- `labels`, `buttons`, `sections`: texts; buttons, options, tabs and check boxes; parts that fold
- `slider`, `text_field`, `dropdown`: widgets that edit a value
- `scroll_area`: content that is higher than its place
"""
