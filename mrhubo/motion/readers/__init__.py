"""Files of human motion, one module a format."""
