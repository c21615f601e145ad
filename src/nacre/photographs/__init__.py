"""Materials from photographs in known light."""
