"""Plots as matplotlib figures, for papers and screens, on pages of an exact size."""
