"""The benchmark: a frozen suite of maps and tracks for any controller, whose results anybody can check."""
