"""The hybrid DAE: its records, the rules of its laws, and the tolerances with which they are judged."""
