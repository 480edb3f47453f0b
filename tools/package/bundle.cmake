# Run when the component "bundle" is installed: puts the libraries that the programs need, glibc's
# excepted, into lib/, where the programs' RPATH ($ORIGIN/../lib) finds them, and says which glibc
# all of it needs. Given: PROGRAMS (built, with that RPATH), LOADED (libraries loaded by name),
# OBJDUMP, STRIP, NAME (with the version).
set(root "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}")
file(MAKE_DIRECTORY "${root}/bin" "${root}/lib")
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${PROGRAMS} LIBRARIES ${LOADED}
  RESOLVED_DEPENDENCIES_VAR libraries
  POST_EXCLUDE_REGEXES "/(libc|libm|libdl|libpthread|librt|libresolv|ld-linux[^/]*)\\.so\\.[0-9]+$")
set(files "")
foreach(program IN LISTS PROGRAMS)
  get_filename_component(name "${program}" NAME)
  file(COPY_FILE "${program}" "${root}/bin/${name}")
  execute_process(COMMAND "${STRIP}" "${root}/bin/${name}" COMMAND_ERROR_IS_FATAL ANY)
  list(APPEND files "${root}/bin/${name}")
endforeach()
foreach(library IN LISTS libraries LOADED)
  get_filename_component(name "${library}" NAME)  # its soname: what the loader asks for
  file(REAL_PATH "${library}" real)
  message(STATUS "Bundling: ${root}/lib/${name}")
  file(COPY_FILE "${real}" "${root}/lib/${name}")
  list(APPEND files "${root}/lib/${name}")
endforeach()

set(glibc 2.0)
foreach(file IN LISTS files)
  execute_process(COMMAND "${OBJDUMP}" -T "${file}" OUTPUT_VARIABLE symbols
    COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "GLIBC_[0-9.]*[0-9]" versions "${symbols}")
  list(REMOVE_DUPLICATES versions)
  foreach(version IN LISTS versions)
    string(REPLACE "GLIBC_" "" version "${version}")
    if(version VERSION_GREATER glibc)
      set(glibc ${version})
    endif()
  endforeach()
endforeach()
message(STATUS "The bundle needs glibc ${glibc}")
file(WRITE "${root}/README" "${NAME} for Linux on x86-64, with glibc ${glibc} or later.

Unpack it anywhere, without root, and run bin/rattan; move it as you like. Every library
that it needs besides glibc lies in lib/. Where the parts are:

  bin/rattan                  the program; bin/rattan --help, man -l share/man/man1/rattan.1.gz
  bin/rattan-bench            throughput
  share/bash-completion, share/zsh, share/fish
                              completion of options: source the file of your shell
  share/doc/rattan/licenses   the licences of all that is in here; also bin/rattan --licenses
")
