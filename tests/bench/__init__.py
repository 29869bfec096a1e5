"""Benchmarks of the product, compared with other programs in the same run: `make bench`."""
