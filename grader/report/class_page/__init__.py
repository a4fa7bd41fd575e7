"""A class's results as one page (`index.html`): a table, what cost most, who shares a fault, what to run again.

`submissions.gather` reads the results one by one, `statistics` counts and draws them, `page` makes the HTML.
"""
