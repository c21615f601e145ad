"""One member of each family that nacre can be extended by: a module each."""
