"""Results of runs, comparisons and sweeps: their runs, how folders are read, and reference placements."""
