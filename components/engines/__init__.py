"""Combustion engines: torque from a map or a Willans line, with their fuel."""
