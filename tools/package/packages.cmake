# `cpack` in the build folder: Debian packages (rattan, and librattan-dev for programs that use it
# as a library) and the bundle, an archive that runs from any folder of any x86-64 Linux whose glibc
# is recent enough.
set(CPACK_PACKAGE_NAME rattan)
set(CPACK_PACKAGE_VENDOR Rattan)
set(CPACK_PACKAGE_CONTACT "Rattan developers <rattan@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "turn triangle scans into quad-dominant meshes")
set(CPACK_PACKAGE_DESCRIPTION
"Rattan converts huge triangle scans into curvature-aligned quad-dominant
meshes and writes them with Draco, OBJ, PLY or OFF. It works in parallel and
out of core within a given amount of memory, repairs what is wrong with a
scan, keeps its topology, and makes the same bytes every time.")
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_THREADS 0)
set(CPACK_RATTAN_PROCESSOR ${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/generator.cmake)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_COMPONENT_PROGRAMS_GROUP main)
set(CPACK_COMPONENT_DOCUMENTS_GROUP main)
set(CPACK_COMPONENT_DEBIAN_MAIN_GROUP main)
set(CPACK_COMPONENT_DEVELOPMENT_GROUP dev)
set(CPACK_COMPONENT_DEBIAN_DEV_GROUP dev)
set(CPACK_DEBIAN_MAIN_PACKAGE_NAME rattan)
set(CPACK_DEBIAN_MAIN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_MAIN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MAIN_PACKAGE_RECOMMENDS draco)
set(CPACK_DEBIAN_MAIN_PACKAGE_SUGGESTS "librattan-dev, slurm-client")
set(CPACK_COMPONENT_MAIN_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME librattan-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libdraco-dev, libembree-dev, libfmt-dev, libhdf5-dev, \
libjpeg-dev, libopenmesh-dev, libpng-dev, libtbb-dev, libzstd-dev, pkg-config, zlib1g-dev")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "cmake, libjemalloc-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION
"turn triangle scans into quad-dominant meshes (library)
${CPACK_PACKAGE_DESCRIPTION}
.
This package has the static library, its headers and its CMake package.")

set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
include(CPack)
