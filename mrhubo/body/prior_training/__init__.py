"""How the open body prior is trained and measured."""
