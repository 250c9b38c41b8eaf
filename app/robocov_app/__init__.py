"""What people touch of robocov: the command line, pictures, frames and films."""
