# Flags of gfortran: by build, those of the kernels, of free lines, and for the place of module files. Another compiler
# needs a table of the same rows, in a file like this or in config.mk (doc/user/running.md).

FLAGS_gfortran_opt = -std=f2008 -O3 -march=$(ARCH) -fopenmp-simd -fno-tree-loop-distribute-patterns $(vectors) -g
FLAGS_gfortran_profile = $(FLAGS_gfortran_opt) -fno-omit-frame-pointer -fno-optimize-sibling-calls
FLAGS_gfortran_avx2 = $(FLAGS_gfortran_opt) -mno-avx512f -mprefer-vector-width=256
FLAGS_gfortran_debug = -std=f2008 -g -fno-var-tracking-assignments -Og -fcheck=all,no-array-temps -fsanitize=address,undefined -ffpe-trap=invalid,zero,overflow \
   -fbacktrace -Wall -Wextra -Wno-c-binding-type -Wno-unused-dummy-argument
# For `make fuzz`: every branch leaves its mark; afl-fuzz brings the assembler that writes it.
FLAGS_gfortran_fuzz = -std=f2008 -g -O1 -fcheck=all,no-array-temps -B$(AFL)
# Work arrays of the kernels in static memory, where they begin at a cache line: on the stack that is luck, and costs a tenth of a
# step where it fails (no procedure there is entered twice).
FLAGS_gfortran_kernels = -fmax-stack-var-size=4096 -Wno-surprising
FLAGS_gfortran_long_lines = -ffree-line-length-none
FLAGS_gfortran_modules = -J

