"""Methods of other people, each our own implementation from its description."""
