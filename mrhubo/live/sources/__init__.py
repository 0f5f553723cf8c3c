"""Where a live session's frames and heartbeats come from."""
