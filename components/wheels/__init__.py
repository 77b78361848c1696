"""Wheels and tyres: rigid rolling, slip with relaxation, Magic Formula."""
