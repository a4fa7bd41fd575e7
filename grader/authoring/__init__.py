"""A first rubric from a run of a correct package: discover what it has, observe it, propose criteria."""
