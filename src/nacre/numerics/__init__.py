"""Small numerical tools: layers of networks, least squares, color channels, decompositions."""
