"""Conversion of foreign maps to an `environment`: cleaning, boundary and obstacles, starts."""
