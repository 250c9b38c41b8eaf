"""The subcommands of `robocov`: parse, call, print; the work is done elsewhere."""
