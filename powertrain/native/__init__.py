"""A compiled model outside of Python: C99 source with the loop over steps and events, and its driver."""
