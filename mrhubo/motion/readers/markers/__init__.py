"""Human motions from markers on the skin."""
