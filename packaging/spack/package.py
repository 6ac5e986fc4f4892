# SPDX-License-Identifier: MIT
"""Recipe of Spack: `spack repo add` the folder of this file's repository, then `spack install stirpoint`."""

from spack.package import *


class Stirpoint(CMakePackage):
    """Friction stir processing with the Material Point Method."""

    homepage = "https://github.com/stirpoint/stirpoint"
    git = "https://github.com/stirpoint/stirpoint.git"
    license("MIT")

    version("main", branch="main")

    variant("fftw", default=True, description="Direct solver of the heat equation in a box")
    variant("petsc", default=False, description="Multigrid for implicit heat conduction")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("hdf5@1.10:+fortran+mpi")
    depends_on("fftw@3:", when="+fftw")
    depends_on("petsc@3.17:~complex", when="+petsc")
    requires("%gcc@12:", msg="gfortran 12 or newer")

    def cmake_args(self):
        return [
            self.define_from_variant("STIRPOINT_FFTW", "fftw"),
            self.define_from_variant("STIRPOINT_PETSC", "petsc"),
            self.define("STIRPOINT_TESTS", self.run_tests),
            self.define("STIRPOINT_ARCH", "native"),
            self.define("HDF5_ROOT", self.spec["hdf5"].prefix),
        ]
