"""Every form in which a result, or a class, is shown. Student text is hostile wherever it is shown.

In come results, rubrics and figures; out go texts and files. `forms` is the registry: one file for each form of one
result (`markdown`, `terminal`, `html/` …); `class_page/` is the page of a class. All share `losses` (the order in which
a result is read), `view` (a criterion's points, places and words, and what a student sees of a result),
`sentences` and `text` (text made harmless). Nothing is judged here, no points are changed.
"""
