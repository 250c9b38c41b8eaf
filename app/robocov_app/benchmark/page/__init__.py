"""The page that compares results of the benchmark."""
