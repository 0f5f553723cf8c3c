"""What `mrhubo describe` makes of a robot's model: a tree in text, a config, and a picture of it beside the human."""
