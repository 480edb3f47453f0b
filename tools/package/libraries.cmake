# The libraries beneath Rattan's own, found the same way by Rattan's build and, as a part of
# find_package(rattan), by programs that use it.
find_dependency(TBB)
find_dependency(embree 3)
find_dependency(draco)
find_dependency(JPEG)
find_dependency(OpenMesh)
find_dependency(PNG)
find_dependency(ZLIB)
find_dependency(fmt)
find_dependency(PkgConfig)
if(NOT TARGET PkgConfig::ZSTD)
  pkg_check_modules(ZSTD QUIET REQUIRED IMPORTED_TARGET libzstd)
endif()

# HDF5's static library where there is one: the shared one brings libcurl and thirty more, for
# remote files that Rattan has no use for, and every process would pay for loading them with 7 ms
# and 6 MiB.
if(NOT TARGET rattan::hdf5)
  find_path(RATTAN_HDF5_INCLUDE hdf5.h PATH_SUFFIXES hdf5/serial REQUIRED)
  find_library(RATTAN_HDF5_LIBRARY NAMES libhdf5.a hdf5_serial hdf5 NAMES_PER_DIR
    PATH_SUFFIXES hdf5/serial REQUIRED)
  find_library(RATTAN_SZIP_LIBRARY NAMES sz REQUIRED)
  mark_as_advanced(RATTAN_HDF5_INCLUDE RATTAN_HDF5_LIBRARY RATTAN_SZIP_LIBRARY)
  # A library with a place, not a mere interface: so what it needs comes behind it for the linker.
  add_library(rattan::hdf5 UNKNOWN IMPORTED)
  set_target_properties(rattan::hdf5 PROPERTIES IMPORTED_LOCATION ${RATTAN_HDF5_LIBRARY})
  target_include_directories(rattan::hdf5 INTERFACE ${RATTAN_HDF5_INCLUDE})
  target_link_libraries(rattan::hdf5 INTERFACE ${RATTAN_SZIP_LIBRARY} ZLIB::ZLIB ${CMAKE_DL_LIBS} m)
endif()
