"""What the mouse does on the sheet. Knows no pygame."""
