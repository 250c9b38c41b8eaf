"""Mouse tools of the editor. Knows no pygame."""
