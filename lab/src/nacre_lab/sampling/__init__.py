"""Samplers that nacre's are measured beside: learned ones, and products with the light."""
