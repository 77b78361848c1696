"""The simulation engine: fused steps, joint modes, exact events."""
