"""What vehicles are measured by: cycles, consumption, acceleration, maps of whole drivelines."""
