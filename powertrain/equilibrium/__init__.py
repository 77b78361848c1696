"""One operating point: its conditions, modes and unknowns.

In turn: the records of many points (``points``); the steady problem of a model and what of it has a closed form (``placed``,
``elimination``, ``system``); the solution where only modes are unknown (``search``), and where other unknowns are implicit: their equations
and rules (``laws``), Newton's method (``corrector``), its starts (``beginnings``), what replaces it where it fails (``continuation``), and
all of these at many points (``solutions``). ``operating`` takes one or the other.
"""
