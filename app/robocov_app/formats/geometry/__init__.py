"""Geometry that all formats share: from shapes or cells to free space, and from free space to a map.

A reader collects `shapes` or `cells`, which become the free space of a foreign map. `conversion` builds an
environment from it, and `simplification` reduces the number of vertices. All of them use the modules next to
these packages.
"""
