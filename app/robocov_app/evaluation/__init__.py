"""Inputs that the benchmark and the paper's replication share: reference placements and random densities."""
