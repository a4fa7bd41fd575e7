"""Mutation testing of rubrics: faulty packages are made of a correct one, graded, and compared with what is declared.

`faulty_packages.py` reads a lab's file of faulty packages and builds them, `rubric_test.py` grades them and says which
were noticed. `operators/` makes mistakes by name, in the `solution.py` that is the correct package in memory.
"""
