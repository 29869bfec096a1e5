"""What touches the balloon: courses of force or travel, tissue between, and the kinds in a scenario."""
