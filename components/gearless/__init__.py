"""Gearless differentials: circular-arc cam, spherical cam and spatial linkage."""
