# gimp3d. `make help` lists the targets. Local settings go into config.mk (not tracked); every variable set here or under mk/
# with ?= can be given there, in the environment or on the command line.

-include config.mk

BUILD ?= opt
# What fills the halo: src/parallel/halo_mpi.f90, or halo_coarray.f90, which needs OpenCoarrays.
HALO ?= mpi
halos := mpi coarray
ifeq ($(filter $(HALO),$(halos)),)
$(error HALO=$(HALO): the halo is filled by mpi or coarray)
endif
build := build/$(BUILD)$(if $(filter coarray,$(HALO)),_coarray)
.DEFAULT_GOAL := gimp3d

# ---- compiler and flags --------------------------------------------------------------------------------------

once = $(eval $(1) := $(2))$($(1))
ifeq ($(origin FC),default)
FC := mpifort
endif
# The machine that is built for: that of the build itself, or as the compiler's -march names it (x86-64-v3, for other machines too).
ARCH ?= native

include mk/gfortran.mk

AFL ?= /usr/lib/afl
FLAGS_EXTRA ?=
vectors := $(if $(filter x86_64,$(shell uname -m)),-mprefer-vector-width=512)
builds := opt debug profile avx2 fuzz
$(if $(filter $(BUILD),$(builds)),,$(error BUILD=$(BUILD): the builds are $(builds)))
# FLAGS_opt=... on the command line or in config.mk stands for the row of the table.
flags = $(strip $(or $(FLAGS_$(BUILD)),$(FLAGS_$(compiler)_$(BUILD))) $(FLAGS_EXTRA) $(if $(filter coarray,$(HALO)),-fcoarray=lib) $(flags_here))

# The compiler behind FC, by its own word (OpenCoarrays' wrapper starts gfortran).
version = $(call once,version,$(shell $(FC) --version 2>/dev/null | head -n 1))
compiler = $(if $(findstring GNU Fortran,$(version))$(findstring OpenCoarrays,$(version)),gfortran,$(firstword $(version)))

include mk/libraries.mk

# ---- sources -------------------------------------------------------------------------------------------------

main := src/app/gimp3d.f90
sources := $(filter-out $(patsubst %,src/parallel/halo_%.f90,$(filter-out $(HALO),$(halos))),\
   $(sort $(shell find -H src -name '*.f90' -o -name '*.F90')))
test_sources := $(sort $(shell find -H test -name '*.f90' 2>/dev/null))
library_objects := $(patsubst src/%,$(build)/obj/src/%.o,$(basename $(filter-out $(main),$(sources))))
program := $(if $(filter $(main),$(sources)),$(build)/gimp3d)

# Goals that compile nothing need no list of what depends on what.
plain_goals := help help-all clean distclean deps needed venv demo test check test-all bench fuzz effects plans plots hardness hard map study api uninstall report gallery paraview movie closeup benchmarks error_bar pole_figure solve vumat
ifneq ($(filter-out $(plain_goals),$(or $(MAKECMDGOALS),gimp3d)),)
include $(build)/depends.mk
stale_modules := $(filter-out $(modules:%=$(build)/mod/%.mod),$(wildcard $(build)/mod/*.mod))
$(if $(stale_modules),$(shell rm -f $(stale_modules)))
endif
test_binaries := $(patsubst test/%.f90,$(build)/test/%,$(test_programs))
# TESTS="unit input/run ...": only these suites or tests (all when empty)
TESTS ?=
# a script may run any program of its suite
wanted := $(if $(TESTS),$(TESTS:%=$(build)/test/%) $(TESTS:%=$(build)/test/%/%) \
   $(foreach t,$(TESTS),$(if $(wildcard test/$t.sh),$(build)/test/$(dir $t)%)),%)
chosen_binaries := $(filter $(wanted),$(test_binaries))

# ---- build ---------------------------------------------------------------------------------------------------

.PHONY: gimp3d library tests FORCE
.DELETE_ON_ERROR:
.SUFFIXES:

##@ Build (BUILD=opt, debug, profile, avx2; PYTHON=path; settings may stand in config.mk)
## gimp3d       build the program (the default)
# build the program (the default); BUILD=opt (default), debug, profile or avx2 (without AVX-512);
# HALO=coarray: ghosts by coarrays, in place of MPI
gimp3d: library $(program)
ifeq ($(program),)
	@echo "$(main) is not there yet: built $(build)/libgimp3d.a only"
else
	@[ "$$(readlink $@)" = $(program) ] || ln -sfn $(program) $@
	@[ '$(MAKELEVEL)' != 0 ] || [ '$(words $(or $(MAKECMDGOALS),gimp3d))' != 1 ] || \
	   [ ! $(program) -ot $(build)/depends.mk.time ] || echo "gimp3d is up to date ($(program))"
endif

library: $(build)/libgimp3d.a

### tests        build the test programs without running them
tests: gimp3d $(chosen_binaries)

$(build)/gimp3d: $(build)/obj/$(main:.f90=.o) $(build)/libgimp3d.a
	@echo "  link     $@"
	@$(FC) $(flags) -o $@ $^ $(libraries)

$(build)/libgimp3d.a: $(library_objects)
	@echo "  archive  $@"
	@rm -f $@ && ar rcs $@ $^

$(build)/test/libtest.a: $(test_objects)
	@mkdir -p $(@D)
	@rm -f $@ && ar rcs $@ $^

$(test_binaries): $(build)/test/%: $(build)/obj/test/%.o $(build)/test/libtest.a $(build)/libgimp3d.a
	@mkdir -p $(@D)
	@$(FC) $(flags) -o $@ $^ $(libraries)

$(build)/obj/%.o: %.f90 $(build)/flags
	@mkdir -p $(@D) $(build)/mod
	@echo "  compile  $<"
	@$(compile) -c -o $@ $<

$(build)/obj/%.o: %.F90 src/parallel/petsc_versions.h $(build)/flags
	@mkdir -p $(@D) $(build)/mod
	@echo "  compile  $<"
	@$(petsc_compile) -c -o $@ $<

$(build)/obj/src/kernels/%.o: private flags_here = $(FLAGS_$(compiler)_kernels)

# A module file that the compiler left alone (its interface is as it was) is older than its object; then nothing that uses it is
# compiled again.
$(build)/mod/%.mod:
	@[ -f $@ ] || { rm -f $<; echo "$@ was missing: type make once more"; exit 1; }

# Written anew when they change, so that what depends on them is built again.
write_if_changed = { cmp -s $(1).new $(1) && rm -f $(1).new || mv $(1).new $(1); }

$(build)/flags: FORCE
	@command -v $(firstword $(FC)) > /dev/null || \
	   { echo "$(firstword $(FC)) is not there; \`make deps\` says what is missing"; exit 1; }
	@[ $(HALO) = mpi ] || [ '$(COARRAY_LIBS)' ] || \
	   { echo "HALO=coarray needs OpenCoarrays for Open MPI: apt-get install libcoarrays-openmpi-dev, or say in config.mk COARRAY_LIBS = ..."; \
	     exit 1; }
	@[ '$(flags)' ] && [ '$(FLAGS_$(compiler)_modules)' ] || { echo "$(FC) starts \"$(version)\", for which there are no flags:" \
	   "gimp3d is built with gfortran, or with a compiler whose FLAGS_$(compiler)_... are set in config.mk as the Makefile sets those of gfortran"; \
	   exit 1; }
	@mkdir -p $(@D)
	@{ echo '$(petsc_compile)'; echo '$(libraries)'; echo '$(version)'; } > $@.new && $(call write_if_changed,$@)

$(build)/depends.mk: FORCE
	@mkdir -p $(@D)
	@awk -v build=$(build) -f tools/depends.awk $(sources) $(test_sources) > $@.new && $(call write_if_changed,$@)
	@touch $@.time # when make began, by which it says that there was nothing to do

# ---- set-up --------------------------------------------------------------------------------------------------

.PHONY: deps needed venv help help-all clean distclean

# Only `make deps`, `make demo` and `make test` install anything with apt, where they may; other targets say what is missing. With
# SETUP=no these look only too, and build/venv is not made: PYTHON names a Python then.
SETUP ?= yes

### deps         look for compiler and libraries; install them where apt may (ATOMS=yes: LAMMPS too)
# see that compiler and libraries are there; install them where apt may be used, else say what to type
deps:
	@HDF5_INC='$(HDF5_INC)' HDF5_LIB='$(HDF5_LIB)' METIS_INC='$(METIS_INC)' PYTHON='$(PYTHON)' ATOMS='$(ATOMS)' sh tools/deps

needed:
	@HDF5_INC='$(HDF5_INC)' HDF5_LIB='$(HDF5_LIB)' METIS_INC='$(METIS_INC)' PYTHON='$(PYTHON)' ATOMS='$(ATOMS)' sh tools/deps --look

# PYTHON=path takes a Python that already has what post/pyproject.toml names; without it, one is set up under build/venv.
export PYTHONPATH := $(CURDIR)/post:$(CURDIR)/test/harness:$(CURDIR)/test/regression:$(CURDIR)/test/stability
post = $(python) -m gimp3d
ifeq ($(PYTHON),)
python := build/venv/bin/python
venv: build/venv/complete
	@:
else
python := $(PYTHON)
venv:
	@:
endif

### venv         the Python packages of post, in build/venv
build/venv/complete: post/pyproject.toml
	@[ '$(SETUP)' != no ] || { echo "SETUP=no, and build/venv is not there: say PYTHON=/path/to/python, of a Python that has what $< names"; exit 1; }
	@echo "  venv     build/venv (numpy, scipy, h5py, matplotlib, vtk)"
	@mkdir -p build && rm -rf build/venv
	@python3 -m venv build/venv && build/venv/bin/python -m pip install --quiet --disable-pip-version-check -e post || { \
	   rm -rf build/venv; \
	   echo "The Python packages could not be installed. With a Python that has them (dependencies of $<), type: make PYTHON=/path/to/python ..."; \
	   exit 1; }
	@touch $@

### help         this list
help:
	@echo 'make [TARGET] [VARIABLE=value]; documents: doc/user; each target of a line: make help-all'
	@sed -n 's/^##@ //p; s/^## /  /p' Makefile mk/tools.mk mk/tests.mk mk/install.mk
	@echo "  more        $$(sed -n 's/^### \([a-z_-]*\) .*/\1/p' Makefile mk/tools.mk mk/tests.mk mk/install.mk | xargs)" | \
	   fold -s -w 64 | sed '2,$$s/^/               /'

### help-all     all targets with their variables
help-all:
	@sed -n 's/^##@ /\n/p; s/^##*# /  /p' Makefile mk/tools.mk mk/tests.mk mk/install.mk

## clean        remove what was compiled
clean:
	rm -rf $(builds:%=build/%) build/*_coarray build/effects build/plans build/api gimp3d

### distclean    clean, and remove the Python packages (out/ and config.mk stay)
distclean: clean
	rm -rf build

# What several of the parts ask for.
mpi := . test/harness/mpi.sh;
jobs = $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(shell nproc 2>/dev/null || echo 1))
look = @$(MAKE) --no-print-directory needed && $(MAKE) --no-print-directory venv
set_up = $(if $(filter no,$(SETUP)),$(look),@$(MAKE) --no-print-directory deps && $(MAKE) --no-print-directory venv)
RANKS ?= 1

include mk/tools.mk mk/tests.mk mk/install.mk
