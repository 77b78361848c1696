"""Drive cycles: speed over time or distance."""
