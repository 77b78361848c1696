"""The simulator: steps, event location, modes after events."""
