"""Formats of cells: ROS maps, pictures, Tiled maps and MovingAI grids."""
