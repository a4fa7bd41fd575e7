"""Mutation testing of rubrics: faulty packages are made of a correct one, graded, and compared with what is declared.

A lab's rubric, its correct package and its file of faulty packages come in; a `RubricTest` goes out, which says of each
faulty package whether the rubric noticed it. `faulty_packages.load_mutants` reads the file and `plan_declared` says
what is built; `operators/` makes mistakes by name, in the correct package in memory (`solution.load_solution`).
`rubric_test.run_test` builds and grades all of it and compares.
"""
