"""The language in which components are written: fields, ports, equations, laws and maps."""
