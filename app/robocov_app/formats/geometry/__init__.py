"""Geometry that all formats share: from shapes or cells to free space, and from that to a map.

A reader collects `shapes` or `cells`, which become the free space of a foreign map. `conversion` builds an
environment from it, with fewer vertices by `simplification`. The modules next to these packages are their
common basis.
"""
