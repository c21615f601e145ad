"""What each choice is worth: one module a study."""
