"""The interactive window: what happens in it (no pygame), and how it is shown and touched."""
