"""Random maps of the suite, each drawn from a seed."""
