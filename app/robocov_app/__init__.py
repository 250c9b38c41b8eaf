"""Application layer of robocov: command line, figures, frames and videos."""
