"""Formats of worlds of other simulators: ARGoS, IR-SIM and Stage."""
