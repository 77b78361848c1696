"""Derivatives of a run: variational equations along its steps, saltation at its events."""
