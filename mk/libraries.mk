# Libraries: asked for once, and only when something is compiled.

multiarch = $(call once,multiarch,$(shell gcc -print-multiarch))
PKG_CONFIG ?= pkg-config
PETSC_FLAGS ?= $(call once,PETSC_FLAGS,$(shell $(PKG_CONFIG) --cflags-only-I PETSc))
PETSC_LIBS ?= $(call once,PETSC_LIBS,$(shell $(PKG_CONFIG) --libs PETSc))
COARRAY_LIBS ?= $(call once,COARRAY_LIBS,$(shell $(PKG_CONFIG) --libs caf-openmpi 2>/dev/null))
# HDF5: where HDF5_INC and HDF5_LIB say, else where pkg-config does, else in Debian's folders.
HDF5_INC ?=
HDF5_LIB ?=
hdf5_flags = $(call once,hdf5_flags,$(or $(HDF5_INC:%=-I%),$(shell $(PKG_CONFIG) --cflags-only-I hdf5-openmpi 2>/dev/null),\
   -I/usr/include/hdf5/openmpi))
hdf5_folders = $(call once,hdf5_folders,$(or $(HDF5_LIB:%=-L%),$(shell $(PKG_CONFIG) --libs-only-L hdf5-openmpi 2>/dev/null),\
   -L/usr/lib/$(multiarch)/hdf5/openmpi))
METIS_INC ?= /usr/include
METIS_LIB ?=
comma := ,
libraries = $(if $(filter fuzz,$(BUILD)),-Wl$(comma)--as-needed) $(hdf5_folders) -lhdf5_fortran -lhdf5 $(METIS_LIB:%=-L%) -lmetis $(PETSC_LIBS) -ldl \
   $(if $(filter coarray,$(HALO)),$(COARRAY_LIBS))
compile = $(FC) $(flags) $(hdf5_flags) $(FLAGS_$(compiler)_modules)$(build)/mod
petsc_compile = $(compile) $(FLAGS_$(compiler)_long_lines) $(PETSC_FLAGS)
