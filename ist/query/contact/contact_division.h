#pragma once

#include <cstddef>
#include <cstdint>

#include "query/contact/contact_bins.h"
#include "query/contact/tree_cuts.h"

namespace ist {

/// Divides a contact along the tree of one of its solids. Where it is divided, and thus a patch's
/// identity, depends on the tree alone; the pose decides which divisions are worth a patch.
class ContactDivision {
 public:
  /// `radius`: of the tree's root, in the frame of the bins.
  ContactDivision(ContactBins& bins, std::uint32_t bin_count, double radius) noexcept;

  /// Until there are `wanted` parts or nothing is left to divide; then by place in the tree.
  void run(std::size_t wanted) noexcept;

  std::size_t size() const noexcept { return size_; }
  const ContactPart& part(std::size_t i) const noexcept { return parts_[i]; }

  Overlap sum(const ContactPart& part) const noexcept;

 private:
  const ContactBin& bin(std::uint32_t i) const { return bins_[order_[i]]; }

  /// How badly one force at one point stands for the part's: the spread of the places where it
  /// pulls, and what of the pulls cancels. Never less for a part than for its own parts.
  double loss(const ContactPart& part) const;

  /// Divides `part` into itself and `other`. False if there was nothing to divide.
  bool divide(ContactPart& part, ContactPart& other);

  const TreeCuts cuts_;
  const ContactBin* const bins_;
  ContactPart* const parts_;
  std::uint32_t* const order_;
  std::uint32_t* const spare_;
  const double bend_cost_;  ///< of a unit of pull that cancels
  double total_pull_ = 0;
  std::size_t size_ = 0;
};

}  // namespace ist
