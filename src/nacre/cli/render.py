"""`nacre render`."""
