"""Where a live session's joint angles go."""
