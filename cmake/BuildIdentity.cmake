# Runs at every build. Writes OUT from TEMPLATE if the content changes, with facts that are unknown at configuration:
# the commit and a hash of the sources that determine results. Further parameters: SOURCE, the tree; VERSION, COMPILER,
# FLAGS, LIBRARIES.
set(COMMIT "")
find_program(git git)
if(git)
  # The tree may belong to another user (containers, a build as root); git would refuse to read it.
  execute_process(COMMAND ${git} -c safe.directory=* describe --always --dirty --abbrev=10
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()

# All sources of legopt-worker. Paths are hashed as well, so moving a file changes the hash.
set(listing "")
foreach(folder legopt lcmtypes bus app worker)
  file(GLOB_RECURSE files RELATIVE ${SOURCE}
    ${SOURCE}/${folder}/*.h ${SOURCE}/${folder}/*.inc ${SOURCE}/${folder}/*.cpp ${SOURCE}/${folder}/*.lcm
    ${SOURCE}/${folder}/*.def)
  list(FILTER files EXCLUDE REGEX "^(legopt/statistics|bus/bridge)/")  # no module here computes results
  list(SORT files)
  foreach(file IN LISTS files)
    file(SHA256 ${SOURCE}/${file} hash)
    string(APPEND listing "${hash} ${file}\n")
  endforeach()
endforeach()
string(SHA256 SOURCES "${listing}")
configure_file(${TEMPLATE} ${OUT} @ONLY)
