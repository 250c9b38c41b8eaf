"""The benchmark: a frozen suite of maps and tracks for rating controllers, with verifiable results."""
