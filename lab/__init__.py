"""The research behind nacre: `src/nacre_lab` is installed, the rest runs from a checkout."""
