"""Commands on map files."""
