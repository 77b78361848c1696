"""One operating point: the conditions of a steady state, and the modes and unknowns that satisfy them."""
