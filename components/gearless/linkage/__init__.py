"""The spatial linkage differential RRSCSRR (Madhavan 1996)."""
