#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <set>
#include <utility>
#include <vector>

namespace legopt::worldgen {

/// Inflation of the heuristic and effort limits of AnytimeSearch.
struct AnytimeSearchOptions {
  double first_epsilon = 5.0;            ///< initial inflation of the heuristic, >= 1
  double epsilon_step = 1.0;             ///< decrease of epsilon after every solution
  std::int64_t max_expansions = 8000;    ///< limit until the first solution
  std::int64_t extra_expansions = 1500;  ///< additional limit after the first solution, to improve the bound
};

/// ARA* (Likhachev et al. 2003): A* with the heuristic inflated by epsilon. After a solution epsilon decreases and the
/// search continues with its previous results, until epsilon is 1 or the effort limit is reached.
///
/// A derived class numbers its states by AddState, in the order in which the search reaches them, and implements
/// Expand. State kDone means that the goal is reached; kStart is the first state that the derived class adds. One
/// object runs one search; one thread.
class AnytimeSearch {
 public:
  virtual ~AnytimeSearch() = default;
  AnytimeSearch(const AnytimeSearch&) = delete;
  AnytimeSearch& operator=(const AnytimeSearch&) = delete;

 protected:
  static constexpr int kDone = 0;   ///< the goal
  static constexpr int kStart = 1;  ///< the first added state
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  AnytimeSearch() : states_(1) {}

  /// Adds a state. `estimate`: estimated cost to the goal, infinite if the goal cannot be reached; `least`: lower bound
  /// of that cost.
  int AddState(double estimate, double least);
  /// Adds the successors of a state by Relax.
  virtual void Expand(int state) = 0;
  /// Reports an action that leads from one state to another one at a cost > 0.
  void Relax(int from, int to, double cost);

  /// Searches from kStart. Returns false if no solution was found within the limits.
  bool Run(const AnytimeSearchOptions& options);

  // Results of a successful run.
  /// Returns the states of the solution in order, from kStart to the last one before kDone.
  std::vector<int> Path() const;
  double cost() const { return states_[kDone].g; }         ///< cost of the solution
  double Bound() const;                                    ///< the cost is at most this times the optimum; >= 1
  std::int64_t expansions() const { return expansions_; }  ///< number of expanded states
  double estimate(int state) const {
    return states_[static_cast<std::size_t>(state)].h;
  }  ///< estimate that AddState received

 private:
  struct State {
    double g = kInfinity;
    double h = 0.0;      ///< estimated remaining cost
    double least = 0.0;  ///< lower bound of the remaining cost
    int parent = -1;
    int round = -1;  ///< round of the last expansion
  };
  using Entry = std::pair<double, int>;

  State& At(int id) { return states_[static_cast<std::size_t>(id)]; }
  bool Improve(std::int64_t limit);
  void Reopen();

  std::vector<State> states_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
  std::set<int> members_;  ///< states in open_, which may also contain outdated entries
  std::set<int> inconsistent_;
  double epsilon_ = 1.0;
  int round_ = 0;
  std::int64_t expansions_ = 0;
};

}  // namespace legopt::worldgen
