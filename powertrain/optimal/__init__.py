"""The compiled model as functions for optimisation: dynamics in given modes, identification, optimal control."""
