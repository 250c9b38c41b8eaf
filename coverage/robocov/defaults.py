"""Default values of runs, each in one place: the library, the command line and files refer to them."""

import math

DEFAULT_CONTROLLER = "rapf"
"""Name of the controller."""
DEFAULT_ROBOTS = 6
"""Number of robots."""
DEFAULT_DURATION_S = 60.0
"""Simulated time."""
DEFAULT_DT_S = 1 / 60
"""Control period."""
DEFAULT_LATTICE = 128
"""The coverage cost is computed on a lattice of this number of sites along each side of the map."""

DEFAULT_RADIUS_M = 0.1
DEFAULT_MASS_KG = 1.0
DEFAULT_MAX_SPEED_M_S = 1.0
DEFAULT_MAX_ACCELERATION_M_S2 = 2.0
DEFAULT_VISCOSITY_N_S_M = 2.0
DEFAULT_SENSING_RANGE_M = 3.0
DEFAULT_COMMUNICATION_RANGE_M = math.inf
DEFAULT_TRACK_WIDTH_M = 0.0
"""Zero means that robots have no wheels, and move in any direction."""
DEFAULT_TURNING_RATE_RAD_S = 4.0
