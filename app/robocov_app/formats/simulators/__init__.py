"""World formats of other simulators: ARGoS, IR-SIM and Stage."""
