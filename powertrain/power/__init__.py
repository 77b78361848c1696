"""Power flow: paths, loops, circulation, the share of a variator, and their diagrams."""
