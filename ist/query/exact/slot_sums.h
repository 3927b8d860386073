#pragma once

#include <cstdint>

#include "query/exact/exact_scratch.h"
#include "query/exact/overlap_terms.h"

namespace ist {

/// Sums of terms in eight slots: a term's slot is its place in the order of its kind.
class SlotSums {
 public:
  void add_crossings(const ExactTerms& terms) noexcept;
  void add_triangles(const ExactTerms& terms) noexcept;
  ExactSums total() const noexcept;
  double rounding() const noexcept;

 private:
  void add_volumes(const double (&six_volumes)[8]) noexcept;

  double high_[8] = {}, low_[8] = {};
  double moment_[3][8] = {}, force_[3][8] = {}, torque_[3][8] = {}, rounding_[8] = {};
};

/// Adds lane l of terms.
void add_crossing_term(const ExactTerms& terms, std::uint32_t l, ExactSums& sums) noexcept;
void add_triangle_term(const ExactTerms& terms, std::uint32_t l, ExactSums& sums) noexcept;

}  // namespace ist
