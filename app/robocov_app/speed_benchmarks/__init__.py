"""Benchmarks of speed: each time is compared with that of a yardstick, measured in alternation with it."""
