"""Studies, which define sweeps: their files, parameters, gains and size."""
