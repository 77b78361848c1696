"""The spherical cam differential (Chaudhary, Angeles and Morozov 2014)."""
