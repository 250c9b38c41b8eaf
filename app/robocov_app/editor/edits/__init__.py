"""Pure edits: a sketch in, a sketch out."""
