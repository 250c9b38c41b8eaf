"""Plots as matplotlib figures, for papers and screens: pages of an exact size, and what is drawn on them."""
