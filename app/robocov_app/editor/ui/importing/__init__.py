"""The import of foreign maps: the dialog with its options, previews and colors, and the service behind it."""
