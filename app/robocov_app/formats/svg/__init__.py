"""SVG: a part of the standard as drawings of maps use it."""
