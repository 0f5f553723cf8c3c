"""Human motion to files, one module a format."""
