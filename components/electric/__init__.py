"""Electric machines, batteries and the direct-current bus between them."""
