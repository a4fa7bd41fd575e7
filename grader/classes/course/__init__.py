"""A course (`course.yaml`): late days over all its labs, attempts, how far each lab is, and one gradebook for all.

A course and its labs' folders come in; rosters with late days, a status and rows of a gradebook go out. How a lab is
graded and published is not its business: each lab is a class like any other.
"""
