"""Other people's methods, as their papers describe them."""
