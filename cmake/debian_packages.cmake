# What `cpack` makes: the library with its interfaces, and the program, as Debian packages.
set(CPACK_GENERATOR DEB)
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # Tests and examples are in no package.
set(CPACK_PACKAGE_NAME cilantro)
set(CPACK_PACKAGE_VENDOR cilantro)
set(CPACK_PACKAGE_CONTACT "the cilantro developers")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL development)
if(TARGET cilantro_visualization)
  list(APPEND CPACK_COMPONENTS_ALL visualization)
endif()
if(TARGET cilantro_window)
  list(APPEND CPACK_COMPONENTS_ALL window)
endif()
if(TARGET cilantro_mpi)
  list(APPEND CPACK_COMPONENTS_ALL mpi)
endif()
if(TARGET cilantro_tool)
  list(APPEND CPACK_COMPONENTS_ALL program)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_STRIP_FILES ON)

set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION
  "${PROJECT_DESCRIPTION}\nThe compiled library, the interfaces of its modules, and the package for CMake.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcilantro-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# The compiled library holds this Eigen, and importers must use the same; the archive of a later Debian may have another.
string(REGEX MATCH "[0-9]+$" cilantro_eigen_patch ${Eigen3_VERSION})
math(EXPR cilantro_eigen_patch "${cilantro_eigen_patch} + 1")
string(REGEX REPLACE "[0-9]+$" "${cilantro_eigen_patch}" cilantro_next_eigen ${Eigen3_VERSION})
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libeigen3-dev (>= ${Eigen3_VERSION}), libeigen3-dev (<< ${cilantro_next_eigen}~), libpng-dev, libjpeg62-turbo-dev, liblzf-dev, libqhull-dev, libomp-22-dev, libc6-dev")
# Not required: in Debian 12 a new enough CMake comes from backports.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS
  "clang-22, clang-tools-22, ninja-build, cmake (>= 3.28)")

set(CPACK_DEBIAN_VISUALIZATION_DESCRIPTION
  "Pictures of point clouds, without a display\nThe component visualization of cilantro.")
set(CPACK_DEBIAN_VISUALIZATION_PACKAGE_NAME libcilantro-visualization-dev)
set(CPACK_DEBIAN_VISUALIZATION_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_VISUALIZATION_PACKAGE_DEPENDS "libcilantro-dev (= ${PROJECT_VERSION})")

set(CPACK_DEBIAN_WINDOW_DESCRIPTION
  "Windows that show point clouds\nThe component window of cilantro.")
set(CPACK_DEBIAN_WINDOW_PACKAGE_NAME libcilantro-window-dev)
set(CPACK_DEBIAN_WINDOW_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_WINDOW_PACKAGE_DEPENDS "libcilantro-visualization-dev (= ${PROJECT_VERSION}), libglfw3-dev (>= 3.3)")

set(CPACK_DEBIAN_MPI_DESCRIPTION
  "Point clouds shared by several processes and machines\nThe component mpi of cilantro, for Open MPI.")
set(CPACK_DEBIAN_MPI_PACKAGE_NAME libcilantro-mpi-dev)
set(CPACK_DEBIAN_MPI_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "libcilantro-dev (= ${PROJECT_VERSION}), libopenmpi-dev")
set(CPACK_DEBIAN_MPI_PACKAGE_SHLIBDEPS ON)

set(CPACK_DEBIAN_PROGRAM_DESCRIPTION
  "Point clouds on the command line\nShows, converts, filters, aligns and segments point clouds in PLY, PCD and text files.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME cilantro)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
include(CPack)
