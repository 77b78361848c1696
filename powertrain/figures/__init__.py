"""What draws with matplotlib: signals over time, schematics of models."""
