"""Rubric mutation testing: mutants of a correct package, and what each of them must cost."""
