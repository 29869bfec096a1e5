"""Commands that make and use recordings: record, export, evaluate, plot, replay."""
