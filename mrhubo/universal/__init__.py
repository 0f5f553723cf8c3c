"""One network for every robot: an optimiser that was trained on random chains of joints and runs on any robot's."""
