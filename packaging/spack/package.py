import os

from spack_repo.builtin.build_systems.makefile import MakefilePackage

from spack.package import *


class Gimp3d(MakefilePackage):
    """Solid mechanics with the generalized interpolation material point method: indentation, contact, metals."""

    homepage = "file:///gimp3d"  # the address of the repository that this file is in
    git = "file:///gimp3d"
    license("MIT")
    version("main", branch="main")

    depends_on("fortran", type="build")
    depends_on("c", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("petsc@3.18: +mpi ~complex ~int64")
    depends_on("hdf5@1.10: +mpi +fortran")
    depends_on("metis@5: ~int64")
    depends_on("python@3.11:", type="run")
    for name in ("numpy", "scipy", "h5py", "matplotlib"):
        depends_on(f"py-{name}", type="run")
    depends_on("vtk@9.3: +python", type="run")

    def settings(self):
        spec = self.spec
        # the folder of HDF5's Fortran modules: include, include/shared or mod/shared, by its version
        modules = os.path.dirname(sorted(find(spec["hdf5"].prefix, "hdf5.mod"))[0])
        return [
            "SETUP=no",
            f"FC={spec['mpi'].mpifc}",
            f"HDF5_INC={modules}",
            f"HDF5_LIB={spec['hdf5'].prefix.lib}",
            f"METIS_INC={spec['metis'].prefix.include}",
            f"METIS_LIB={spec['metis'].prefix.lib}",
            f"PREFIX={self.prefix}",
        ]

    def build(self, spec, prefix):
        make("gimp3d", *self.settings())

    def install(self, spec, prefix):
        make("install", *self.settings())
