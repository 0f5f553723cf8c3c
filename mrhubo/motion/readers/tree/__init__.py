"""Motions of trees of joints (BVH, ASF/AMC): which joint is which, where up is, and the motion of our skeleton."""
