"""Drawing: theme, camera and layers that show an environment, a team and one moment of a run."""
