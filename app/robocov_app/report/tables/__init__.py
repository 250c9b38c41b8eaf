"""The tables of a report, whose cells are text."""
