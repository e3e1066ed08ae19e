# SPDX-License-Identifier: Apache-2.0
# The only build file. Everything made lies under $(BUILD); a flavour is a
# build folder: make BUILD=build/asan FLAVOUR=sanitize check-here

BUILD   ?= build
FLAVOUR ?= plain
PREFIX  ?= /usr/local
VERSION := $(shell git describe --tags --always --dirty 2>/dev/null || echo 0.1)

FOLDERS  := base files colorimetry drivers simulator render config calibration daemon
PROGRAMS := boothd boothctl boothcal boothsim
boothd_in := daemon
boothctl_in := daemon
boothcal_in := calibration
boothsim_in := simulator

PACKAGES := git make gcc g++ libc6-dev pkg-config libusb-1.0-0-dev libudev-dev libmodbus-dev libhidapi-dev libiio-dev \
  libopencv-core-dev libopencv-calib3d-dev libopencv-imgproc-dev libopencv-photo-dev libceres-dev libopenexr-dev \
  libglfw3-dev libepoxy-dev libegl-dev libgl1-mesa-dri libinih-dev libjansson-dev libpng-dev libssl-dev liblcms2-dev \
  libmatio-dev libpango1.0-dev libcairo2-dev librsvg2-dev libsystemd-dev libcmocka-dev libumockdev-dev umockdev xvfb xauth \
  systemd psychtoolbox-3-common clang-format
PKGS := libusb-1.0 libudev libmodbus hidapi-hidraw libiio OpenEXR glfw3 epoxy egl inih jansson libpng libcrypto lcms2 matio \
  pangocairo librsvg-2.0 libsystemd cmocka umockdev-1.0

OPTIMISE := -O2
SANITIZE_sanitize := -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
SANITIZE := $(SANITIZE_$(FLAVOUR))
WARN     := -Wall -Wextra -Werror -Wshadow -Wvla -Wswitch-enum
INCLUDES := -I. -I$(BUILD) $(shell pkg-config --cflags $(PKGS) 2>/dev/null) -isystem /usr/include/opencv4 -isystem /usr/include/eigen3
ALL_C     = -std=c11 -D_GNU_SOURCE $(OPTIMISE) -g -fPIC -fopenmp $(WARN) -Wstrict-prototypes -Wmissing-prototypes \
            -DBOOTHD_VERSION='"$(VERSION)"' -DBOOTHD_DATADIR='"$(PREFIX)/share/boothd"' $(INCLUDES) $(SANITIZE) $(CFLAGS)
ALL_CXX   = -std=c++17 -D_GNU_SOURCE $(OPTIMISE) -g -fPIC -fopenmp -Wall -Wextra -Werror $(INCLUDES) $(SANITIZE) $(CXXFLAGS)

# What each folder may lean on outside the tree.
base_libs        := -ljansson -lpthread -lm
files_libs       := -linih -lOpenEXRCore-3_1 -lpng -lcrypto $(base_libs)
colorimetry_libs := -lm
drivers_libs     := -lusb-1.0 -lmodbus -lhidapi-hidraw -liio -ludev -lopencv_calib3d -lopencv_core -lstdc++ -lm
simulator_libs   := $(shell pkg-config --libs umockdev-1.0 2>/dev/null) -lmodbus -lutil -lm -lpthread
simulator_test_libs := -lusb-1.0 -lhidapi-hidraw
render_libs      := -lglfw -lepoxy -lEGL -lm
config_libs      := -lm
calibration_libs := $(shell pkg-config --libs pangocairo librsvg-2.0 2>/dev/null) -llcms2 -lopencv_photo -lopencv_imgproc \
  -lopencv_calib3d -lopencv_core -lceres -lglog -lmatio -lstdc++ -lm
daemon_libs      := -lsystemd -lpthread -lm

# One short line a step; V=1 shows the whole commands.
say = $(if $(V),,@echo '$(1)';)

below = $(shell sed -n 's/^$(1): *//p' tests/layers.txt)
archives = $(foreach f,$(1),$(BUILD)/$(f).a)
libs = -Wl,--start-group $(call archives,$(1)) -Wl,--end-group -Wl,--as-needed $(foreach f,$(1),$($(f)_libs)) -fopenmp $(SANITIZE)

MAINS    := $(foreach p,$(PROGRAMS),$($(p)_in)/$(p).c)
SOURCES  := $(filter-out $(MAINS),$(foreach f,$(FOLDERS),$(wildcard $(f)/*.c $(f)/tables/*.c $(f)/*.cpp)))
TESTS    := $(wildcard $(FOLDERS:%=tests/%/test_*.c) tests/whole/test_*.c)
FAKES    := $(wildcard tests/fakes/*.c)
FAULTS   := $(wildcard tests/whole/faults_*.c)
DAY      := $(wildcard tests/whole/day_*.c)
SHADERS  := $(wildcard render/shaders/*.glsl colorimetry/*.glsl)
object    = $(patsubst %,$(BUILD)/%.o,$(basename $(1)))

.PHONY: FORCE all deps demo session check check-here faults bench format layers links made install install-only uninstall clean
.SECONDARY:

all: $(PROGRAMS:%=$(BUILD)/%) made

deps:
	tests/deps.sh $(PACKAGES)

$(BUILD)/packages.ok: Makefile
	@mkdir -p $(@D)
	@for p in $(PKGS); do pkg-config --exists $$p || { echo "boothd: the library $$p is missing; run 'make deps' (as root) first" >&2; exit 1; }; done
	@for h in opencv4/opencv2/calib3d.hpp opencv4/opencv2/photo.hpp opencv4/opencv2/imgproc.hpp ceres/ceres.h; do [ -e /usr/include/$$h ] || { echo "boothd: <$$h> is missing; run 'make deps' (as root) first" >&2; exit 1; }; done
	@touch $@

$(BUILD)/%.o: %.c | $(BUILD)/packages.ok
	@mkdir -p $(@D)
	$(call say,CC $<)$(CC) $(ALL_C) -MMD -MP -c $< -o $@

$(BUILD)/%.o: %.cpp | $(BUILD)/packages.ok
	@mkdir -p $(@D)
	$(call say,C++ $<)$(CXX) $(ALL_CXX) -MMD -MP -c $< -o $@

# Shaders are files; this one rule embeds them as C strings.
$(BUILD)/render/shaders_embedded.inc: $(SHADERS)
	@mkdir -p $(@D)
	for f in $^; do printf '{"%s",\n' $$(basename $$f); sed -e 's/\\/\\\\/g; s/"/\\"/g; s/^/"/; s/$$/\\n"/' $$f; echo '},'; done > $@

# What names the version or the place it is installed in is made again when that changes.
$(call object,$(shell grep -l -r --include='*.c' 'BOOTHD_VERSION\|BOOTHD_DATADIR' $(FOLDERS))): $(BUILD)/version
$(BUILD)/version: FORCE
	@mkdir -p $(@D)
	@echo '$(VERSION) $(PREFIX)' | cmp -s - $@ || echo '$(VERSION) $(PREFIX)' > $@
FORCE:

define folder_rule
$(BUILD)/$(1).a: $(call object,$(filter $(1)/%,$(SOURCES)))
	@rm -f $$@
	@$(AR) rcs $$@ $$^
$(BUILD)/tests/$(1)/%: $(BUILD)/tests/$(1)/%.o $(call object,$(FAKES)) $(call archives,$(1) $(call below,$(1)))
	$$(call say,LD $$@)$(CC) -o $$@ $$< $(call object,$(FAKES)) $(call libs,$(1) $(call below,$(1))) $($(1)_test_libs) -lcmocka
$(BUILD)/links/$(1): $(BUILD)/$(1).a $(call archives,$(call below,$(1)))
	@mkdir -p $$(@D)
	$$(call say,LINKS $(1))$(CC) -shared -Wl,--no-undefined -o $$@ -Wl,--whole-archive $$< -Wl,--no-whole-archive $(call libs,$(1) $(call below,$(1)))
endef
$(foreach f,$(FOLDERS),$(eval $(call folder_rule,$(f))))

define program_rule
$(BUILD)/$(1): $(BUILD)/$($(1)_in)/$(1).o $(call archives,$($(1)_in) $(call below,$($(1)_in)))
	$$(call say,LD $$@)$(CC) -o $$@ $$< $(call libs,$($(1)_in) $(call below,$($(1)_in)))
endef
$(foreach p,$(PROGRAMS),$(eval $(call program_rule,$(p))))

# These alone may see both sides of a wire: drivers and simulator.
$(BUILD)/tests/whole/%: $(BUILD)/tests/whole/%.o $(call object,$(FAKES)) $(call archives,$(FOLDERS)) $(PROGRAMS:%=$(BUILD)/%)
	$(call say,LD $@)$(CC) -o $@ $(filter %.o,$^) $(call libs,$(FOLDERS)) -lcmocka

$(BUILD)/tests/whole/faults: $(call object,$(FAULTS))
$(BUILD)/tests/whole/test_day: $(call object,$(DAY))

$(call object,render/program.c): $(BUILD)/render/shaders_embedded.inc

links: $(FOLDERS:%=$(BUILD)/links/%)

layers:
	tests/layers.sh

check:
	@$(MAKE) -s deps
	$(MAKE) layers links
	@rm -f $(BUILD)/results $(BUILD)/asan/results
	@failed=0; \
	$(MAKE) check-here || failed=1; \
	$(MAKE) BUILD=$(BUILD)/asan FLAVOUR=sanitize check-here || failed=1; \
	tests/run.sh --total $(BUILD)/results $(BUILD)/asan/results || failed=1; \
	exit $$failed

# Last and beside each other those that mostly wait: every fault of
# docs/faults.md on running emulators, and two minutes over the wire.
LONG := $(BUILD)/tests/whole/faults $(BUILD)/tests/whole/soak

check-here: all $(TESTS:%.c=$(BUILD)/%) $(LONG) $(BUILD)/tests/bench/bench
	BUILD=$(BUILD) tests/run.sh $(BUILD)/results $(TESTS:%.c=$(BUILD)/%) --together $(LONG)

demo:
	@$(MAKE) -s deps
	$(MAKE) all
	BUILD=$(BUILD) calibration/demo.sh $(BUILD)/demo

faults: all $(LONG)
	BUILD=$(BUILD) tests/run.sh $(BUILD)/faults.results --together $(LONG)

# A technician's whole session, from bare settings to a sealed report.
session:
	@$(MAKE) -s deps
	$(MAKE) all
	BUILD=$(BUILD) calibration/demo.sh --whole $(BUILD)/session

bench: $(BUILD)/tests/bench/bench
	$< $(BUILD)/bench.json

$(BUILD)/tests/bench/bench: $(BUILD)/tests/bench/bench.o $(call archives,calibration $(call below,calibration))
	$(call say,LD $@)$(CC) -o $@ $< $(call libs,calibration $(call below,calibration))

format:
	clang-format -i $$(git ls-files '*.c' '*.h' '*.cpp')

# What is installed: source, place below PREFIX, mode. Uninstall reads the same list.
MADE      := $(BUILD)/made/boothd.conf $(BUILD)/made/70-boothd.rules $(BUILD)/made/boothd.service $(BUILD)/made/boothd.conf.5
INSTALLED := $(foreach p,$(PROGRAMS),$(BUILD)/$(p)=bin/$(p)=755) \
  $(foreach d,materials booths,$(foreach f,$(wildcard config/$(d)/*),$(f)=share/boothd/$(d)/$(notdir $(f))=644)) \
  $(foreach f,$(wildcard simulator/scenarios/*),$(f)=share/boothd/scenarios/$(notdir $(f))=644) \
  $(foreach f,$(wildcard man/*.1),$(f)=share/man/man1/$(notdir $(f))=644) \
  man/boothd.8=share/man/man8/boothd.8=644 \
  $(BUILD)/made/boothd.conf.5=share/man/man5/boothd.conf.5=644 \
  $(BUILD)/made/boothd.conf=share/boothd/boothd.conf=644 \
  $(BUILD)/made/boothd.service=lib/systemd/user/boothd.service=644 \
  $(BUILD)/made/70-boothd.rules=lib/udev/rules.d/70-boothd.rules=644 \
  systemd/boothd.sysusers=lib/sysusers.d/boothd.conf=644 \
  systemd/boothd.tmpfiles=lib/tmpfiles.d/boothd.conf=644 \
  README.md=share/doc/boothd/README.md=644 LICENSE=share/doc/boothd/LICENSE=644

$(BUILD)/made/boothd.conf: $(BUILD)/boothd
	@mkdir -p $(@D)
	@$< --describe >$@

$(BUILD)/made/70-boothd.rules: $(BUILD)/boothd
	@mkdir -p $(@D)
	@$< --udev >$@

$(BUILD)/made/boothd.conf.5: man/boothd.conf.5.in $(BUILD)/boothd
	@mkdir -p $(@D)
	@$(BUILD)/boothd --describe-man >$@.settings
	@sed -e '/@settings@/{r $@.settings' -e 'd' -e '}' $< >$@
	@rm $@.settings

$(BUILD)/made/boothd.service: systemd/boothd.service $(BUILD)/version
	@mkdir -p $(@D)
	@sed 's|@bindir@|$(PREFIX)/bin|' $< >$@

made: $(MADE)

install: all
	@$(MAKE) -s --no-print-directory install-only
	@echo "installed in $(DESTDIR)$(PREFIX); then, as root: systemd-sysusers, systemd-tmpfiles --create, udevadm control --reload"

# Copies what is built already.
install-only:
	@for i in $(INSTALLED); do \
	    from=$${i%%=*}; mode=$${i##*=}; to=$${i#*=}; to=$${to%=*}; \
	    install -D -m $$mode "$$from" "$(DESTDIR)$(PREFIX)/$$to" || exit 1; done

uninstall:
	@for i in $(INSTALLED); do to=$${i#*=}; rm -f "$(DESTDIR)$(PREFIX)/$${to%=*}"; done
	@for d in share/boothd/materials share/boothd/booths share/boothd/scenarios share/boothd share/doc/boothd; do \
	    [ ! -d "$(DESTDIR)$(PREFIX)/$$d" ] || rmdir --ignore-fail-on-non-empty "$(DESTDIR)$(PREFIX)/$$d"; done

clean:
	rm -rf build

-include $(patsubst %,$(BUILD)/%.d,$(basename $(SOURCES) $(MAINS) $(TESTS) $(FAKES) $(FAULTS) $(DAY) tests/bench/bench.c tests/whole/faults.c tests/whole/soak.c))
