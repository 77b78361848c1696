"""Integration methods as symbolic steps, and what controls their size."""
