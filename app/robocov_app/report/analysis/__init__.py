"""Analysis of the runs of a result: grouping by controller and gains, scaling, comparison and selection."""
