"""Commands that the lab adds to `nacre`."""
