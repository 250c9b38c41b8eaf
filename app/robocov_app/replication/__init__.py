"""The paper again: its figures on environments of the same kinds, and its claims over many maps."""
