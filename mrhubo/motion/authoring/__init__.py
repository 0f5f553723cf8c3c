"""Human motions made from key poses: `data/motions/make.py` writes the shipped ones with it."""
