"""What a session simulates: map, team, controllers and their gains."""
