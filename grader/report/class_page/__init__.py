"""A class's results as one page (`index.html`): a table, what cost most, who shares a fault, what to run again.

(Entry, GradingResult), pair by pair → `gather` → counted and drawn (`statistics`) → `page`, with what is left to do
"""
