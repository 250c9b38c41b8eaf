"""Editor model: sketches, their files, their problems. Knows no pygame."""
