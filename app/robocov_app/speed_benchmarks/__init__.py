"""Benchmarks of speed: each time is compared with that of a baseline, measured in alternation with it."""
