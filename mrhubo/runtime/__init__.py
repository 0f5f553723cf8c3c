"""What every command stands on: progress, threads and ranks, places, tables, the trainer, MLflow."""
