"""Integration methods as symbolic steps, and step size control."""
