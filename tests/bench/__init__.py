"""Benchmarks, measured in one run and printed beside a peer: `make bench`."""
