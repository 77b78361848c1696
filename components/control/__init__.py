"""Drivers, gear schedules and the control of variable ratios."""
