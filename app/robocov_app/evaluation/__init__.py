"""Shared inputs of the benchmark and of the paper's replication: reference placements, random densities."""
