"""Commands about the force model: estimate, uncertainty, validate, accuracy."""
