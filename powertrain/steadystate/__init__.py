"""Operating points on grids: nothing accelerates, and all modes are found together."""
