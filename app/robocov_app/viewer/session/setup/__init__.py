"""Setup of a session: map, team, controllers and their gains."""
