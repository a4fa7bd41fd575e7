"""Reports of one result: files, and the terminal's table. Student text is hostile wherever it is shown."""
