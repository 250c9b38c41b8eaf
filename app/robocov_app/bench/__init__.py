"""Benchmarks of speed: each time beside a yardstick that is taken in turn with it."""
