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
    depends_on("petsc@3.18: +mpi ~complex")
    depends_on("hdf5@1.10: +mpi +fortran +hl")
    depends_on("metis@5: ~int64")

    parallel = True

    def settings(self):
        spec = self.spec
        return [
            "SETUP=no",
            f"FC={spec['mpi'].mpifc}",
            f"HDF5_INC={spec['hdf5'].prefix.include}",
            f"HDF5_LIB={spec['hdf5'].prefix.lib}",
            f"METIS_INC={spec['metis'].prefix.include}",
            f"PREFIX={self.prefix}",
        ]

    def build(self, spec, prefix):
        make("gimp3d", *self.settings())

    def install(self, spec, prefix):
        make("install", *self.settings())
