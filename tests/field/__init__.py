"""Files of other projects, as laboratories and studios write them, and what nacre makes of each."""
