"""Analyses of a compiled model and its runs: linear models, energy audit, sweeps."""
