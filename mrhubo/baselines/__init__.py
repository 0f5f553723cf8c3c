"""Methods that ours is measured against."""
