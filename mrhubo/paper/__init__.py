"""The paper's tables, from our own runs."""
