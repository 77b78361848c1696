"""Vibration: natural modes, Campbell diagrams, forced response at engine orders, order maps of runs."""
