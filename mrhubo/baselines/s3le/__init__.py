"""S3LE (Choi et al., ICRA 2021), the paper's baseline."""
