"""Application layer of robocov: command line, pictures, frames and films."""
