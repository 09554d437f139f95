# make demo    set up and run the main job
# make test    set up and run the tests
# make lint    format, lint, type and prose checks
# make docs    build the docs site into build/site
# make firmware CONFIG=table.toml GAINS=gains.h   build the firmware of a table into build/firmware; both are optional
# make flash PORT=/dev/ttyUSB0   write what was built last into an Arduino board with an ATmega328P; with CONFIG or GAINS build it first
# make mutants plant 200 small faults and see which of them the tests do not find (half an hour)

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# The variable, unlike the option, also pins what builds the package.
INSTALL := PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --disable-pip-version-check

# Prose: American spelling, and the words of docs/glossary.md.
SPELLED := --builtin clear,rare,en-GB_to_en-US --ignore-words .ci/names README.md CONTRIBUTING.md CHANGELOG.md docs/*.md

.PHONY: demo test lint docs firmware flash mutants clean

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

firmware: $(VENV)/demo.stamp
	@rm -f build/firmware/table.hex   # if this build fails, `make flash` must not write the one before
	$(BIN)/python -m tools.firmware $(if $(CONFIG),--config $(CONFIG)) $(if $(GAINS),--gains $(GAINS)) --out build/firmware

# Never a table that nobody named: without CONFIG and GAINS the board gets what `make firmware` has built last.
flash: $(if $(PORT),$(if $(CONFIG)$(GAINS),firmware))
	@test -n "$(PORT)" || { echo "make flash: name the board's port: make flash PORT=/dev/ttyUSB0" >&2; exit 2; }
	@test -s build/firmware/table.hex || { echo "make flash: nothing is built; run make firmware CONFIG=table.toml" >&2; exit 2; }
	avrdude -p atmega328p -c arduino -P $(PORT) -b $(or $(BOOTLOADER_BAUD),115200) -D -U flash:w:build/firmware/table.hex:i

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
