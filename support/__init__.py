"""Small modules that several packages share; none knows the instrument."""
