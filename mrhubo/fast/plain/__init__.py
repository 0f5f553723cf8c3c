"""The run-time path in NumPy, all frames at a time: what answers where numba is not installed."""
