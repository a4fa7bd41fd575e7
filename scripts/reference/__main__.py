"""`python -m scripts.reference`: write the pages that are made from the code."""

from scripts.reference import FOLDER, PAGES

for name, page in PAGES.items():
    (FOLDER / name).write_text(page(), encoding="utf-8")
