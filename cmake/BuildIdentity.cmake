# Runs in every build: writes OUT from TEMPLATE, if the content changes, with values known only now: the commit and a
# hash of the sources that determine results. Further arguments: SOURCE, the tree; VERSION, COMPILER, FLAGS, LIBRARIES.
set(COMMIT "")
find_program(git git)
if(git)
  # The tree may belong to another user (containers, a build as root); git would refuse to read it.
  execute_process(COMMAND ${git} -c safe.directory=* describe --always --dirty --abbrev=10
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()

# All sources of legopt-worker. Names are hashed as well: a moved file is a different source.
set(listing "")
foreach(room words files legopt lcmtypes bus programs worker)
  file(GLOB_RECURSE files RELATIVE ${SOURCE}
    ${SOURCE}/${room}/*.h ${SOURCE}/${room}/*.inc ${SOURCE}/${room}/*.cpp ${SOURCE}/${room}/*.lcm
    ${SOURCE}/${room}/*.def)
  list(FILTER files EXCLUDE REGEX "^legopt/statistics/")  # judges results, computes none
  list(SORT files)
  foreach(file IN LISTS files)
    file(SHA256 ${SOURCE}/${file} hash)
    string(APPEND listing "${hash} ${file}\n")
  endforeach()
endforeach()
string(SHA256 SOURCES "${listing}")
configure_file(${TEMPLATE} ${OUT} @ONLY)
