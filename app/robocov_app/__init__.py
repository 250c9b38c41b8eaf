"""Application layer of robocov: command line, windows, figures, videos, reports, sweeps and benchmarks."""
