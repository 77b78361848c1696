"""The circular-arc cam differential (Provatidis 2023)."""
