"""What a run keeps in MLflow."""
