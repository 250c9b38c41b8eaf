"""What is edited: sketches, their files, their problems. Knows no pygame."""
