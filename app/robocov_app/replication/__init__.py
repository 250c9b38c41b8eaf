"""The paper's figures on environments of the same kinds, and its claims tested on many maps."""
