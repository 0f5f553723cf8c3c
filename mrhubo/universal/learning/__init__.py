"""How the universal network is trained: random chains, targets, the best answers, the loss."""
