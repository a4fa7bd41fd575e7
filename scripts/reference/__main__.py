"""`python -m scripts.reference`: write the pages that are made from the code."""

from scripts.reference import FOLDER, made

for name, text in made().items():
    (FOLDER / name).parent.mkdir(parents=True, exist_ok=True)
    (FOLDER / name).write_text(text, encoding="utf-8")
