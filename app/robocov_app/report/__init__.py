"""Reports: results as one HTML page that needs nothing else, and the replay in it."""
