"""Studies: figures of speed and of what was tried; nothing here is in the wheel."""
