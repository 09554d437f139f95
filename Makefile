# make demo    set up and run the main job
# make test    set up and run the tests
# make lint    format, lint, type and prose checks
# make docs    build the docs site into build/site
# make mutants plant 200 small faults and see which of them the tests do not find (half an hour)

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# The variable, unlike the option, also pins what builds the package.
INSTALL := PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --disable-pip-version-check

# Prose: American spelling, and the words of docs/glossary.md.
SPELLED := --builtin clear,rare,en-GB_to_en-US --ignore-words .ci/names README.md CONTRIBUTING.md CHANGELOG.md docs/*.md

.PHONY: demo test lint docs mutants clean

demo: $(VENV)/demo.stamp
	$(BIN)/python -m tools.demo --out build/demo

test: $(VENV)/test.stamp
	$(BIN)/python -m pytest -n auto -m 'not realtime'
	$(BIN)/python -m pytest -m realtime   # alone, since they measure time

lint: $(VENV)/test.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/codespell $(SPELLED)
	$(BIN)/python -m tools.prose

docs: $(VENV)/test.stamp
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict -f docs/site/mkdocs.yml

mutants: $(VENV)/test.stamp
	$(BIN)/python -m tools.mutation_score --count 200

$(VENV)/demo.stamp: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable '.[planner]'
	touch $@

$(VENV)/test.stamp: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) build
