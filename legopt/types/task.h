#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "legopt/types/enum_names.h"
#include "legopt/types/input_error.h"

namespace legopt {

/// The task: one static posture at a stance, or a motion through a sequence of stances, constrained at the waypoints
/// only or also between them (docs/explanation/judge.md#continuous-motions).
enum class Task : std::uint8_t {
  kPosture,     ///< one static posture at a stance
  kMotion,      ///< a motion through a sequence of stances
  kContinuous,  ///< motion as a path in time: feet stay planted and nothing collides, also between waypoints
  kBalanced,    ///< like kContinuous, and statically balanced throughout
  kTimed        ///< like kBalanced, along a smooth curve that joints and contacts can execute
};

template <>
inline constexpr auto kEnumNames<Task> = MakeEnumNames<Task>({{Task::kPosture, "posture"},
                                                              {Task::kMotion, "motion"},
                                                              {Task::kContinuous, "continuous"},
                                                              {Task::kBalanced, "balanced"},
                                                              {Task::kTimed, "timed"}});

/// The paper's two initial guesses.
enum class Initialization : std::uint8_t {
  kGood,        ///< contact patches above every target
  kInCollision  ///< contact patches below every target (buried)
};

template <>
inline constexpr auto kEnumNames<Initialization> =
    MakeEnumNames<Initialization>({{Initialization::kGood, "good"}, {Initialization::kInCollision, "in_collision"}});

/// Cost of a solution (docs/explanation/judge.md).
enum class TaskCost : std::uint8_t {
  kTorques,     ///< sum over the waypoints of the squared gravity torques
  kJointSteps,  ///< mean squared joint step between consecutive waypoints
  kDuration,    ///< least duration of the motion per stance, s
};

/// Requirements on the motion between consecutive waypoints; each value includes the previous one.
enum class TransitionRule : std::uint8_t {
  kNothing,   ///< a single posture, no motion
  kScored,    ///< scored, but not part of the verdict
  kFree,      ///< solutions are paths in time: feet planted, no collision
  kBalanced,  ///< like kFree, with the centre of mass over the planted feet
  kTimed,     ///< like kBalanced along a spline through the points, which can be executed (legopt/dynamics/)
};

/// Maximum number of pieces of a path in time between consecutive waypoints.
inline constexpr int kMaxPieces = 16;

/// All properties that distinguish a task from the others. Code tests these, not the task itself. The cost and
/// constraint terms of each task are listed in legopt/problem/terms/task_program.h, one row per task.
struct TaskDescription {
  Task task{};                                ///< the described task
  Task problems{};                            ///< task whose problems are used: itself or another one
  std::string_view title;                     ///< heading of its columns in a table
  std::string_view short_title;               ///< heading for narrow columns
  std::string_view plural;                    ///< plural of its solutions, for sentences
  std::string_view problem_file = {};         ///< file with its problems, in datasets written by this program
  std::string_view legopt_problem_file = {};  ///< file with its problems, in a folder of the original benchmark
  std::string_view stances;                   ///< number of stances of a problem, for sentences
  int least_stances = 1;                      ///< minimum of a problem, >= 1
  int most_stances = 1;                       ///< maximum of a problem, >= least_stances
  int waypoints_per_stance = 1;               ///< consecutive waypoints under the constraints of one stance
  TaskCost cost{};
  TransitionRule between = TransitionRule::kNothing;  ///< requirements between waypoints
  /// Solved window by window; progress counts windows. Otherwise progress counts attempts, and the first success is the
  /// last.
  bool windowed = false;
  bool long_jobs = false;  ///< jobs take seconds or more: no jobs are prefetched
  /// Default limit of term evaluations of a job: about ten times as many as the most expensive terminating job of the
  /// embedded suites needs (docs/reference/suites.md#limits).
  std::int64_t default_effort_limit = 10'000'000;
  /// Default wall-time limit of a job. Only a safety net: ten times as long as the evaluations take on a slow machine.
  double default_wall_limit_s = 3'600;
};

/// Descriptions in the order of the enumerators.
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
                    .waypoints_per_stance = 2,  // docs/explanation/paper.md#waypoints-of-a-stance
                    .cost = TaskCost::kJointSteps,
                    .between = TransitionRule::kScored,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,  // the longest problems have nearly a thousand waypoints
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
                    .between = TransitionRule::kFree,
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
                    .between = TransitionRule::kBalanced,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,
                    .default_wall_limit_s = 72'000},
    TaskDescription{.task = Task::kTimed,
                    .problems = Task::kMotion,
                    .title = "Timed motion",
                    .short_title = "Timed",
                    .plural = "timed motions",
                    .stances = "two or more",
                    .least_stances = 2,
                    .most_stances = std::numeric_limits<int>::max(),
                    .waypoints_per_stance = 2,
                    .cost = TaskCost::kDuration,
                    .between = TransitionRule::kTimed,
                    .windowed = true,
                    .long_jobs = true,
                    .default_effort_limit = 400'000'000,
                    .default_wall_limit_s = 72'000},
};
static_assert(kTasks.size() == kNumEnumerators<Task>);

/// Returns the row of `task` in kTasks.
constexpr const TaskDescription& DescriptionOf(Task task) { return kTasks.at(static_cast<std::size_t>(task)); }

/// Returns whether a task has its own problems; other tasks use those of another task.
constexpr bool HasProblems(const TaskDescription& description) { return description.problems == description.task; }

/// Tasks with their own problems, in the order of the enumerators, which lists them first. Datasets, their files and
/// certificates contain one entry for each.
constexpr std::span<const TaskDescription> ProblemTasks() {
  constexpr auto kCount = std::count_if(kTasks.begin(), kTasks.end(), HasProblems);
  static_assert(std::is_partitioned(kTasks.begin(), kTasks.end(), HasProblems));
  return std::span(kTasks).first(static_cast<std::size_t>(kCount));
}

/// Returns whether a solution is a path: points with time stamps, some of which are waypoints.
constexpr bool HasTimeStamps(Task task) { return DescriptionOf(task).between >= TransitionRule::kFree; }

/// Number of waypoints that a solution must have or, for a path in time, pass through.
constexpr int NumWaypoints(Task task, int num_stances) {
  return DescriptionOf(task).waypoints_per_stance * num_stances;
}

/// Returns the index of the stance that constrains `waypoint`.
constexpr int StanceOfWaypoint(Task task, int waypoint) { return waypoint / DescriptionOf(task).waypoints_per_stance; }

/// Returns whether the centre of mass must be over the planted feet between waypoints.
constexpr bool IsBalanced(Task task) { return DescriptionOf(task).between >= TransitionRule::kBalanced; }

/// Returns whether points are joined by a spline instead of straight pieces, and the motion must have a time law.
constexpr bool HasTimeLaw(Task task) { return DescriptionOf(task).between >= TransitionRule::kTimed; }

/// Returns whether a problem of the task may have `num_stances` stances.
constexpr bool HasStances(Task task, int num_stances) {
  const TaskDescription& description = DescriptionOf(task);
  return num_stances >= description.least_stances && num_stances <= description.most_stances;
}

/// Parses an enum name. Throws InputError "unknown WHAT" with the accepted names; `file` and `field` are its location.
template <NamedEnum Enum>
Enum ReadEnum(std::string_view text, std::string_view file, std::string_view field, std::string_view what) {
  if (const std::optional<Enum> value = ParseEnum<Enum>(text)) return *value;
  throw InputError({.file = std::string(file),
                    .field = std::string(field),
                    .value = std::string(text),
                    .message = "unknown " + std::string(what),
                    .fix = "use " + EnumChoices<Enum>()});
}

/// Parses a task. Throws InputError like ReadEnum, with the field "task".
inline Task ReadTask(std::string_view text, std::string_view file) {
  return ReadEnum<Task>(text, file, "task", "task");
}

/// Parses an initialization; also accepts "in-collision".
inline Initialization ReadInitialization(std::string_view text, std::string_view file) {
  if (text == "in-collision") return Initialization::kInCollision;
  return ReadEnum<Initialization>(text, file, "initialization", "initialisation");
}

}  // namespace legopt
