"""Files of the standards: one material, as renderers open it."""
