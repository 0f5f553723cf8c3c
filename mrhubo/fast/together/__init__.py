"""All frames of a motion together, without PyTorch: what `mrhubo.retargeter.clip` does."""
