"""Interactive pages of runs: one HTML file with the schematic in motion, signals, events, energy, maps and parameters."""
