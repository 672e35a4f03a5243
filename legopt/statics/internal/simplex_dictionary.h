#pragma once

#include <Eigen/LU>
#include <array>
#include <vector>

namespace legopt {

/// Constraints b - range <= A x <= b, 0 <= x <= upper of a linear program with m rows and n columns.
struct LinearProgram {
  Eigen::MatrixXd A;      ///< m x n
  Eigen::VectorXd b;      ///< m
  Eigen::VectorXd range;  ///< m, >= 0 or infinity; 0: an equation
  Eigen::VectorXd upper;  ///< n, >= 0 or infinity
};

/// Step of a nonbasic variable.
struct SimplexStep {
  double length = 0.0;    ///< >= 0; infinite: nothing bounds it
  int row = -1;           ///< row whose basic variable leaves the basis; -1: the variable reaches its other bound
  bool to_upper = false;  ///< the leaving variable leaves at its upper bound
};

/// A basis of a linear program and its dictionary. Variables 0 .. n-1 are the columns, n + i is the slack of row i, in
/// [0, range_i]:
///
///     A x + slack = b,    basic = values - table (nonbasic - their bounds),    objective = constant + rates . nonbasic
///
/// All but a few rows have a basic slack, so that linear systems only have the size k of the core: the rows with
/// nonbasic slacks and the basic columns, both k.
///
/// A workspace: not thread-safe. Source: Chvatal, Linear Programming, 1983, chapters 2 and 8.
class SimplexDictionary {
 public:
  /// Entries of the table below this are 0.
  static constexpr double kPivotTolerance = 1e-9;

  /// Begins with the slacks as basis and all columns at 0. `program` must not change until the next Reset or Replace.
  void Reset(const LinearProgram& program);

  /// Changes to a program of the same size and keeps the basis. Returns false if the sizes differ, the basis is
  /// singular with the new numbers, or there is none; then only Reset may follow.
  bool Replace(const LinearProgram& program);

  /// Computes the values of the basic variables from the program, without the rounding of pivots.
  void Refactor();

  /// Largest error of the core's equations with the values of Refactor; large or NaN if the basis is almost singular.
  double residual() const { return residual_; }

  /// Computes the table, if it is not there. Only after Refactor.
  void BuildTable();

  /// Makes the next BuildTable compute the table from the program, without the rounding of pivots.
  void DropTable() { has_table_ = false; }

  /// Sets the rates of an objective (0, or 1: the one that turns) with `costs` per variable, n + m.
  void SetObjective(int objective, const Eigen::VectorXd& costs);

  /// Moves the variable of a column by a step and exchanges it with the leaving variable.
  void Move(Eigen::Index column, double direction, const SimplexStep& step);

  /// Sets the solution (n): basic variables within their bounds.
  void StoreSolution(Eigen::VectorXd* x) const;

  /// Sets the multipliers (m) of an objective with `costs` per variable from the core. Only after Refactor, before the
  /// next Move.
  void StoreMultipliers(const Eigen::VectorXd& costs, Eigen::VectorXd* y);

  /// Sets the multipliers (m) of objective 0 from its rates, which carry the rounding of the pivots.
  void StoreTableMultipliers(Eigen::VectorXd* y) const;

  /// Returns true if no nonbasic variable improves an objective with `costs` and these multipliers by more than
  /// `tolerance`, without the table.
  bool IsOptimal(const Eigen::VectorXd& costs, const Eigen::VectorXd& y, double tolerance) const;

  Eigen::Index rows() const { return static_cast<Eigen::Index>(basic_.size()); }
  Eigen::Index columns() const { return static_cast<Eigen::Index>(nonbasic_.size()); }

  /// Nonbasic variable of a column of the table.
  int nonbasic(Eigen::Index column) const { return nonbasic_[static_cast<std::size_t>(column)]; }
  /// Basic variable of a row of the table.
  int basic(Eigen::Index row) const { return basic_[static_cast<std::size_t>(row)]; }
  /// Value of basic(row).
  double value(Eigen::Index row) const { return values_[row]; }
  /// Upper bound of basic(row).
  double UpperOfBasic(Eigen::Index row) const { return Upper(basic(row)); }
  /// Upper bound of the nonbasic variable of a column of the table.
  double UpperOfColumn(Eigen::Index column) const { return Upper(nonbasic(column)); }
  /// True if the variable of a column is at its upper bound instead of 0.
  bool IsAtUpper(Eigen::Index column) const { return at_upper_[static_cast<std::size_t>(column)] != 0; }
  /// Decrease of the row's basic variable per unit of the column's variable. After BuildTable.
  double entry(Eigen::Index row, Eigen::Index column) const { return table_(row, column); }
  /// Increase of an objective (SetObjective) per unit of each column's variable, n. Exchanges keep it true.
  Eigen::VectorXd& rates(int objective) { return rates_[static_cast<std::size_t>(objective)]; }
  /// Entry of rates().
  double rate(int objective, Eigen::Index column) const { return rates_[static_cast<std::size_t>(objective)][column]; }

 private:
  double Upper(int variable) const {
    return variable < columns() ? program_->upper[variable] : program_->range[variable - columns()];
  }
  /// Sets core_rows_, core_columns_ and their places.
  void FindCore();
  /// Exchanges rows of the table, which must not be built, so that each basic slack is in its own row.
  void SortRows();
  void Exchange(Eigen::Index column, Eigen::Index row);

  const LinearProgram* program_ = nullptr;
  std::vector<int> basic_;      ///< m: variable of each row of the table
  std::vector<int> nonbasic_;   ///< n: variable of each column of the table
  std::vector<char> at_upper_;  ///< n: of the columns' variables
  Eigen::VectorXd values_;      ///< m
  Eigen::MatrixXd table_;       ///< m x n
  bool has_table_ = false;
  std::array<Eigen::VectorXd, 2> rates_;  ///< n: of the objectives
  std::vector<int> core_rows_;            ///< k: rows of the program with a nonbasic slack
  std::vector<int> core_columns_;         ///< k: basic columns
  std::vector<int> core_places_;          ///< k: rows of the table of the basic columns
  std::vector<int> slack_places_;         ///< m: row of the table of a basic slack, else -1
  Eigen::MatrixXd core_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  double residual_ = 0.0;
  Eigen::VectorXd right_side_, core_right_side_, core_values_, core_multipliers_;
  Eigen::MatrixXd core_table_, core_parts_;
  Eigen::VectorXd basic_costs_, entering_;
};

}  // namespace legopt
