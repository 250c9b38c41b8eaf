"""Mouse tools of the editor. Independent of pygame."""
