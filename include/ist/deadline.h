#pragma once

#include <cstdint>

#include <ist/query.h>
#include <ist/types.h>

namespace IST_API ist {

/// Keeps the queries of one pair of bodies within a time: it chooses their pair budget.
///
/// The loop measures the time of each query:
///
///     ist::Deadline deadline(80);  // [µs]
///     for (;;) {
///       deadline.limit(settings);
///       const double start = microseconds();
///       const ist::Penetration answer = ist::penetration(a, b, settings, workspace);
///       deadline.record(answer, microseconds() - start);
///     }
///
/// The budget jumps only while the bodies are apart, and changes by at most a thousandth per query
/// in contact. Each contact thus has nearly one potential, and a loop gains little energy from the
/// clock. No query is stopped: the budget is chosen so that 95 % of the times are below 0.8 of the
/// deadline. In a contact that never opens, as that of a nut in its thread, the budget follows so
/// slowly that times may be twice the deadline.
///
/// Trivially copyable, without memory of its own. One thread at a time.
class Deadline {
 public:
  /// [µs] Zero, a negative value or NaN: no deadline, and no pair budget.
  explicit Deadline(double microseconds = 0) noexcept;

  /// Sets the pair budget of the next query, and PenetrationSettings::spheres_only: meshes obey no
  /// budget. Where spheres alone are too coarse (SizeMatch::needs_mesh), query without a deadline.
  void limit(PenetrationSettings& settings) const noexcept;

  /// Records the answer and the time of a query of the pair under this budget. An answer of NaN,
  /// and a time that is not positive and finite, are ignored.
  void record(const Penetration& answer, double microseconds) noexcept;

  /// True if more than an eighth of the last queries in contact were late at the smallest budget.
  /// Then the coarsest levels take longer than the deadline: query less often, or bake fewer
  /// spheres. False again once recorded queries are in time.
  bool too_slow() const noexcept;

 private:
  double deadline_ = 0;  ///< [µs] 0: none
  double budget_ = 0;    ///< sphere pairs
  double cost_ = 0;      ///< [µs] per pair of the budget, 95th percentile
  double slow_ = 0;      ///< share of queries in contact that are late at the smallest budget
  std::uint32_t samples_ = 0;
};

}  // namespace ist
