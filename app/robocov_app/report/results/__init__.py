"""Results of runs, comparisons and sweeps: their content, how folders are read, and reference placements."""
