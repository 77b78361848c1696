"""Figures with matplotlib: signals over time, schematics of models."""
