legopt_add_benchmark(subproblem_bench
  SOURCES subproblem_bench.cpp ../optimize/random_subproblem.cpp
  LIBRARIES legopt_optimize)
