"""The tables and figures of the four papers, printed beside computed."""
