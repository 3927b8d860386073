#include "query/scratch/workspace.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace ist {
namespace {

// Lists are written in whole vectors of sixteen, beyond the last valid entry.
constexpr std::size_t kSlack = 32;

PairList make_list(const MemoryHooks& memory, std::size_t capacity) {
  return {hooked_array<std::uint32_t>(memory, capacity + kSlack),
          hooked_array<std::uint32_t>(memory, capacity + kSlack)};
}

}  // namespace

Workspace::Impl::Impl(std::size_t wanted, const MemoryHooks& hooks)
    : memory(hooks),
      capacity(std::max<std::size_t>(wanted, 64)),
      now(make_list(memory, capacity)),
      next(make_list(memory, capacity)),
      ranked(hooked_array<RankedPair>(memory, capacity)),
      bounds(hooked_array<double>(memory, capacity)),
      waiting(hooked_array<WaitingPair>(memory, kWaiting)),
      leaves(hooked<LeafScratch>(memory)),
      masks(hooked_array<std::uint16_t>(memory, capacity)),
      contact(memory),
      exact(capacity, memory) {}

Workspace::Workspace(std::size_t capacity, const MemoryHooks& memory) {
  // The hooks also provide the memory of the Impl.
  const auto release = [&memory](void* p) {
    give_memory_back(memory, p, sizeof(Impl), alignof(Impl));
  };
  std::unique_ptr<void, decltype(release)> bytes(take_memory(memory, sizeof(Impl), alignof(Impl)),
                                                 release);
  impl_.reset(new (bytes.get()) Impl(capacity, memory));
  bytes.release();
}

void Workspace::Release::operator()(Impl* impl) const noexcept {
  const MemoryHooks memory = impl->memory;
  impl->~Impl();
  give_memory_back(memory, impl, sizeof(Impl), alignof(Impl));
}

Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

#ifndef NDEBUG
WorkspaceInUse::WorkspaceInUse(Workspace& workspace) noexcept {
  thread_local const char here = 0;
  Workspace::Impl* const impl = workspace.impl();
  if (impl == nullptr) return;
  const void* user = nullptr;
  if (impl->user.compare_exchange_strong(user, &here)) {
    used_ = impl;
  } else if (user != &here) {
    std::fputs("ist: two threads use one Workspace at a time. Make one for each thread.\n", stderr);
    std::abort();
  }
}

WorkspaceInUse::~WorkspaceInUse() {
  if (used_ != nullptr) used_->user = nullptr;
}
#endif

}  // namespace ist
