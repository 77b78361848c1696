"""Operating points on grids: where nothing accelerates, with all modes found together."""
