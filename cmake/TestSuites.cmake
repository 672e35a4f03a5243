# Longest entries and their seconds on two processors. They start first, so that none of them runs alone at the end.
# ctest measures times itself, but a new build folder has none.
set(legopt_long_entries
  generate_test.ContactDataset.AHumanoidGetsSlidesReachesAndClimbs=150
  db_fault_test.StorageFault.DeathAtAnyCallLosesNothingAcknowledged=106
  client_cli_test.RunCommand=100
  dynamics_test.MotionTimerTest=60
  client_cli_test.SolverCommand=59
  service_test.ServiceTest=52
  generate_test.ContactDataset.EmbeddedMotionsAreBalanced=51
  batch_system_test.BatchSystemTest=47
  db_fault_test.StorageFault.AFullDiskAtAnyCallPassesOnceThereIsSpace=42
  db_fault_test.StorageFault.AnIoErrorAtAnyCallPasses=40
  optimize_allocation_test.Solvers/Allocations=37
  client_cli_test.FilterCommand=35
  watching_test.WatchingTest=34
  generate_test.ContactDataset.AQuadrupedGetsRubbleAndTheSameBitsAgain=33
  legopt_optimize_test.Registry/SolverConformance=33
  client_cli_test.SequenceCommands=32
  db_fault_test.Backup.TwentyUnderLoadAreEachAPrefixOfHistory=32
  client_cli_test.DatasetSheetTest=30)

# legopt_add_suites(PROGRAM TIMEOUT LABELS RESULTS APART): read by ctest. Adds one entry per suite of a GoogleTest
# program, so that one process runs all tests of a suite. If APART is true, adds one entry per test instead: for
# programs with long tests, which can then run in parallel. GoogleTest writes the result of each test into the folder
# RESULTS, where scripts/test-summary reads it.
function(legopt_add_suites program timeout labels results apart)
  get_filename_component(name ${program} NAME)
  if(NOT EXISTS ${program})
    add_test(${name}_NOT_BUILT ${program})
    return()
  endif()
  set(listing ${program}.suites)
  if(NOT EXISTS ${listing} OR ${program} IS_NEWER_THAN ${listing})
    execute_process(COMMAND ${program} --gtest_list_tests OUTPUT_FILE ${listing}.new RESULT_VARIABLE code)
    if(NOT code EQUAL 0)
      message(FATAL_ERROR "${program} --gtest_list_tests: ${code}")
    endif()
    file(RENAME ${listing}.new ${listing})
  endif()
  file(READ ${listing} text)
  string(REGEX REPLACE " *#[^\n]*" "" text "${text}")  # the comment of a test may contain any bytes of its parameter
  string(REPLACE "\n" ";" lines "${text}")
  foreach(line IN LISTS lines)
    if(line MATCHES "^[^ ].*\\.$")
      set(suite "${line}")  # including its dot
      if(NOT apart)
        _legopt_add_entry(${program} "${suite}*" ${timeout} "${labels}" ${results})
      endif()
    elseif(apart AND line MATCHES "^  (.+)$")
      _legopt_add_entry(${program} "${suite}${CMAKE_MATCH_1}" ${timeout} "${labels}" ${results})
    endif()
  endforeach()
endfunction()

function(_legopt_add_entry program filter timeout labels results)
  get_filename_component(name ${program} NAME)
  string(REGEX REPLACE "\\.\\*$" "" entry "${name}.${filter}")
  string(REPLACE "/" "_" file "${entry}")
  add_test(${entry} ${program} --gtest_filter=${filter} --gtest_output=xml:${results}/${file}.xml)
  set_tests_properties(${entry} PROPERTIES TIMEOUT ${timeout} SKIP_RETURN_CODE 77 LABELS "${labels}")
  foreach(long IN LISTS legopt_long_entries)
    if(long MATCHES "^(.+)=([0-9]+)$" AND CMAKE_MATCH_1 STREQUAL entry)
      set_tests_properties(${entry} PROPERTIES COST ${CMAKE_MATCH_2})
    endif()
  endforeach()
endfunction()
