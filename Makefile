# Each target does the set-up that it needs. `make` alone lists them.
LAB := leeds-comp3631-lab1
LABS := $(basename $(notdir $(wildcard rubrics/*.yaml)))
BIN := .venv/bin
TIMES ?= 10
MINUTES ?= 10
# Tests start hundreds of Pythons: compiled modules are kept, whatever the caller's environment says.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup demo test lint docs reference links test-pure test-ros test-all stress fuzz bench screenshots mutants fmt clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

setup: ## ROS 1, the virtual environment and a browser for the tests of pages, where they are missing
	@scripts/setup.sh

demo: ## grade the reference solution and one faulty package, for real
	@scripts/setup.sh --no-browser
	@rm -rf demo
	@$(BIN)/grader grade reference_solutions/$(LAB) --rubric $(LAB) --out demo
	@$(BIN)/python fixtures/make.py $(LAB) counter-resets-to-1 --out demo/packages
	@$(BIN)/grader grade demo/packages/counter-resets-to-1 --rubric $(LAB) --out demo || test $$? -eq 1
	@echo && echo "The reports:" && ls demo/*/report.md

test: lint docs test-pure test-ros ## style, types, documents, tests without ROS, tests with ROS (see test-all)

lint: setup ## style and types
	@$(BIN)/ruff check . fixtures/make.py
	@$(BIN)/ruff format --check . fixtures/make.py
	@$(BIN)/mypy

docs: setup ## the documents as a site in site/, warnings are errors
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

reference: setup ## the pages of docs/reference/ that are made from the code
	@$(BIN)/python -m scripts.reference

links: setup ## whether the pages' links to other sites still work; needs the network
	@$(BIN)/python -m scripts.links

test-pure: setup ## the tests that need no ROS
	@$(BIN)/python -m pytest -m "not ros and not full" -n 3 --dist loadfile

test-ros: setup ## the tests that run real nodes
	@$(BIN)/python -m pytest -m "ros and not full" -n 3 --dist loadfile --no-loadscope-reorder

test-all: lint docs setup ## everything: slow tests, every fixture, every attack
	@$(BIN)/python -m pytest -m "not ros" -n 2
	@$(BIN)/python -m pytest -m ros -n 3 --dist loadfile --no-loadscope-reorder

stress: setup ## the reference solution and every fixture, TIMES times each
	@$(BIN)/python -m tests.stress --times $(TIMES)

fuzz: setup ## the parsers of foreign data at random, for MINUTES minutes; tests/fuzz/README.md
	@$(BIN)/python -m tests.fuzz --minutes $(MINUTES)

bench: setup ## the figures of benchmarks/README.md, measured here
	@$(BIN)/python -m benchmarks.run --write

screenshots: setup ## the pictures of the README, taken anew of real gradings
	@$(BIN)/python -m scripts.screenshots

mutants: setup ## test the rubrics: every mutant of every lab has to lose what it must
	@status=0; for lab in $(LABS); do $(BIN)/grader rubric test $$lab || status=1; done; exit $$status

fmt: setup ## bring the code into shape
	@$(BIN)/ruff check --fix . fixtures/make.py
	@$(BIN)/ruff format . fixtures/make.py

clean: ## remove what the other targets made
	rm -rf .venv demo dist site .mypy_cache .ruff_cache .pytest_cache
	@find benchmarks fixtures grader scripts tests -name __pycache__ -prune -exec rm -rf {} +
