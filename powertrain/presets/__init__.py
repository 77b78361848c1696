"""Components and vehicles by name, their parameters by path, and the files in which they are kept."""
