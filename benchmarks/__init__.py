"""Benchmarks of powertrain, each against its named baseline in the same run. ``python -m benchmarks`` runs all of them."""
