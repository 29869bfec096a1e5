"""Small modules that several packages share. They do not depend on the instrument."""
