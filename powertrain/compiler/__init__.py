"""From a model's text to the hybrid DAE: flatten, alias, index, blocks, torques, assemble."""
