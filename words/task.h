#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "words/words.h"

namespace legopt {

/// What is asked for: one static posture at a stance, or a motion through a sequence of stances, at its waypoints alone
/// or also between them (docs/readings.md#continuous-motions).
enum class Task : std::uint8_t {
  kPosture,     ///< one static posture at a stance
  kMotion,      ///< a motion through a sequence of stances
  kContinuous,  ///< a motion as a path in time: planted feet and no collision between its waypoints, too
  kBalanced     ///< likewise, and statically balanced all the way
};

template <>
inline constexpr auto kWords<Task> = Words<Task>({{Task::kPosture, "posture"},
                                                  {Task::kMotion, "motion"},
                                                  {Task::kContinuous, "continuous"},
                                                  {Task::kBalanced, "balanced"}});

/// The paper's two starting points: soles above every target, or soles below every target (buried).
enum class Initialization : std::uint8_t {
  kGood,        ///< soles above every target
  kInCollision  ///< soles below every target (buried)
};

template <>
inline constexpr auto kWords<Initialization> = Words<Initialization>({{Initialization::kGood, "good"},
                                                                      {Initialization::kInCollision, "in_collision"}});

/// What a solution costs (docs/readings.md#the-judge).
enum class TaskCost : std::uint8_t {
  kTorques,     ///< sum of squared gravity torques of each waypoint
  kJointSteps,  ///< mean squared step of the joints from waypoint to waypoint
};

/// What a task demands between consecutive waypoints, each more than the one before.
enum class Between : std::uint8_t {
  kNothing,   ///< there is nothing between them
  kScored,    ///< what lies there is scored and no part of the verdict
  kFree,      ///< solutions are paths in time: feet planted, nothing in collision
  kBalanced,  ///< likewise, and the centre of mass over the planted feet
};

/// Pieces of a path in time between consecutive waypoints, at most.
inline constexpr int kMostPieces = 16;

/// All that distinguishes a task from the others: code asks this and not which task it is. The terms of a task stand
/// beside the terms (legopt/terms/task_program.h), in one row each as well.
struct TaskDescription {
  Task task{};                                ///< which one this describes
  Task problems{};                            ///< whose problems it has: its own, or those of another task
  std::string_view title;                     ///< heading of its columns in a table
  std::string_view short_title;               ///< where columns are narrow
  std::string_view plural;                    ///< of its solutions, in a sentence
  std::string_view problem_file = {};         ///< with its own problems, in the datasets that we write
  std::string_view legopt_problem_file = {};  ///< likewise in a folder of the original benchmark
  std::string_view stances;                   ///< how many one problem has, in a sentence
  int least_stances = 1;                      ///< of a problem, >= 1
  int most_stances = 1;                       ///< of a problem, >= least_stances
  int waypoints_per_stance = 1;               ///< consecutive ones, under the same constraints
  TaskCost cost{};                            ///< which of the costs solutions have
  Between between = Between::kNothing;        ///< what is asked for from waypoint to waypoint
  /// Solved window by window, so that its progress counts windows; otherwise it counts attempts, of which the first
  /// good one is the last.
  bool windowed = false;
  bool long_jobs = false;  ///< of seconds and more: no job is leased ahead of one that runs
  /// Term evaluations of one job, unless a suite says otherwise: some ten times what the most expensive job of the
  /// embedded suites needs that ends by itself (docs/suites.md#limits).
  std::int64_t default_effort_limit = 10'000'000;
  /// Of one job; no more than a safety net, ten times what the evaluations take on a slow machine.
  double default_wall_limit_s = 3'600;
};

/// In the order of the enumerators.
inline constexpr std::array kTasks = {
    TaskDescription{.task = Task::kPosture,
                    .problems = Task::kPosture,
                    .title = "Posture generation",
                    .short_title = "Posture",
                    .plural = "postures",
                    .problem_file = "problems-posture.json",
                    .legopt_problem_file = "problemsposture.json",
                    .stances = "one stance",
                    .cost = TaskCost::kTorques},
    TaskDescription{.task = Task::kMotion,
                    .problems = Task::kMotion,
                    .title = "Motion generation",
                    .short_title = "Motion",
                    .plural = "motions",
                    .problem_file = "problems-motion.json",
                    .legopt_problem_file = "problemsmotion.json",
                    .stances = "two or more",
                    .least_stances = 2,
                    .most_stances = std::numeric_limits<int>::max(),
                    .waypoints_per_stance = 2,  // docs/readings.md#waypoints-of-a-stance
                    .cost = TaskCost::kJointSteps,
                    .between = Between::kScored,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,  // the longest ones have nearly a thousand waypoints
                    .default_wall_limit_s = 72'000},
    TaskDescription{.task = Task::kContinuous,
                    .problems = Task::kMotion,
                    .title = "Continuous motion",
                    .short_title = "Continuous",
                    .plural = "continuous motions",
                    .stances = "two or more",
                    .least_stances = 2,
                    .most_stances = std::numeric_limits<int>::max(),
                    .waypoints_per_stance = 2,
                    .cost = TaskCost::kJointSteps,
                    .between = Between::kFree,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,
                    .default_wall_limit_s = 72'000},
    TaskDescription{.task = Task::kBalanced,
                    .problems = Task::kMotion,
                    .title = "Continuous motion, balanced",
                    .short_title = "Balanced",
                    .plural = "balanced motions",
                    .stances = "two or more",
                    .least_stances = 2,
                    .most_stances = std::numeric_limits<int>::max(),
                    .waypoints_per_stance = 2,
                    .cost = TaskCost::kJointSteps,
                    .between = Between::kBalanced,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,
                    .default_wall_limit_s = 72'000},
};
static_assert(kTasks.size() == kNumWords<Task>);

/// The row of `task` in kTasks.
constexpr const TaskDescription& DescriptionOf(Task task) { return kTasks.at(static_cast<std::size_t>(task)); }

/// Whether a task has problems of its own; others have those of another task.
constexpr bool HasProblems(const TaskDescription& description) { return description.problems == description.task; }

/// Those that have, in the order of the enumerators, in which they come first: what datasets, their files and
/// certificates are made of.
constexpr std::span<const TaskDescription> ProblemTasks() {
  constexpr auto kCount = std::count_if(kTasks.begin(), kTasks.end(), HasProblems);
  static_assert(std::is_partitioned(kTasks.begin(), kTasks.end(), HasProblems));
  return std::span(kTasks).first(static_cast<std::size_t>(kCount));
}

/// Whether solutions are paths in time: points with a time stamp, waypoints among them.
constexpr bool IsTimed(Task task) { return DescriptionOf(task).between >= Between::kFree; }

/// Waypoints that a solution must have; of a path in time, those that it must lead through.
constexpr int NumWaypoints(Task task, int num_stances) {
  return DescriptionOf(task).waypoints_per_stance * num_stances;
}

/// Index of the stance that constrains `waypoint`.
constexpr int StanceOfWaypoint(Task task, int waypoint) { return waypoint / DescriptionOf(task).waypoints_per_stance; }

/// Whether a problem of the task may have so many stances.
constexpr bool HasStances(Task task, int num_stances) {
  const TaskDescription& description = DescriptionOf(task);
  return num_stances >= description.least_stances && num_stances <= description.most_stances;
}

/// The task that has problems of its own of so many stances; empty when none or several have. For files that do not
/// name it.
constexpr std::optional<Task> TaskOfStances(int num_stances) {
  std::optional<Task> found;
  for (const TaskDescription& description : ProblemTasks()) {
    if (!HasStances(description.task, num_stances)) continue;
    if (found) return std::nullopt;
    found = description.task;
  }
  return found;
}

}  // namespace legopt
