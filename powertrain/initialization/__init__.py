"""Consistent values at the start: what the user fixes, what the model asks, and the modes that follow."""
