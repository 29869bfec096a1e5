"""Validation after the method of the paper: contacts of a recording, compared with a reference force."""
