"""Options, output, failures and exit codes of all commands."""
