#include "query/descent/workspace.h"

#include <algorithm>

namespace ist {
namespace {

// A vector of survivors is stored whole, sixteen at a time, beyond the last one that counts.
constexpr std::size_t kSlack = 32;

PairList make_list(std::size_t capacity) {
  // Not touched before use: a large capacity costs address space, not memory.
  PairList list;
  list.a = std::make_unique_for_overwrite<std::uint32_t[]>(capacity + kSlack);
  list.b = std::make_unique_for_overwrite<std::uint32_t[]>(capacity + kSlack);
  return list;
}

}  // namespace

Workspace::Impl::Impl(std::size_t wanted)
    : capacity(std::max<std::size_t>(wanted, 64)),
      now(make_list(capacity)),
      next(make_list(capacity)),
      ranked(std::make_unique_for_overwrite<RankedPair[]>(capacity)),
      bounds(std::make_unique_for_overwrite<double[]>(capacity)),
      waiting(std::make_unique_for_overwrite<WaitingPair[]>(kWaiting)),
      leaves(std::make_unique_for_overwrite<LeafScratch>()),
      masks(std::make_unique_for_overwrite<std::uint16_t[]>(capacity)),
      patches(std::make_unique_for_overwrite<PatchCache>()) {}

Workspace::Workspace(std::size_t capacity) : impl_(std::make_unique<Impl>(capacity)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

}  // namespace ist
