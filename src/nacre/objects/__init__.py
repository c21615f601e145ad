"""What materials stand on: frozen objects that describe themselves."""
