"""Motions of scenes (FBX, glTF): nodes that move in each other, skeletons among them, and animations by name."""
