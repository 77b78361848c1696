"""Vehicle bodies: mass, resistances, axle loads, the paths of wheels in a bend."""
