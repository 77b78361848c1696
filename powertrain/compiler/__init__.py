"""From a model to the hybrid DAE: flatten, alias, index, blocks, torques, assemble."""
