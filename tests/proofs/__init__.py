"""Proofs of the firmware by a model checker."""
