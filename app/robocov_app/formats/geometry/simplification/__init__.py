"""Simplification of free space that closes no passages and preserves the sizes of obstacles."""
