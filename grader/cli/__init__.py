"""The command line: parses, dispatches, shows; one file a command, one place for errors and exit codes."""
