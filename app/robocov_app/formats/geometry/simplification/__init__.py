"""Simplification of free space, without closing passages or changing sizes."""
