"""Pages of the study.

- `study_pages`: ``index.html``, ``beyond.html`` and ``claims.json``
- `svg_marks`: small drawings in the text
"""
