"""Headless runs: done, saved, read back, filmed."""
