#include "query/contact/contact_bins.h"

#include <new>

#include "base/bits.h"

namespace ist {
namespace {

/// Calls f(bin) for every set bit, in order.
template <class F>
void for_each_bit(const std::uint64_t (&words)[ContactBins::kBins / 64], F f) {
  for (std::uint32_t w = 0; w < ContactBins::kBins / 64; ++w)
    for (const std::uint32_t i : set_bits(words[w])) f(64 * w + i);
}

}  // namespace

ContactBins::ContactBins(const MemoryHooks& memory)
    : sums_(hooked_array<LeafSums>(memory, kBins)),
      guesses_(hooked_array<Overlap>(memory, kBins)),
      bins_(hooked_array<ContactBin>(memory, kBins)),
      parts_(hooked_array<ContactPart>(memory, kBins)),
      order_(hooked_array<std::uint32_t>(memory, kBins)),
      spare_(hooked_array<std::uint32_t>(memory, kBins)) {}

void ContactBins::start(const SphereTree& tree, bool of_b) noexcept {
  for (std::uint64_t& word : marked_) word = 0;
  tree_ = &tree;
  of_b_ = of_b;
  level_ = TreeCuts::bin_level(tree);
}

void ContactBins::mark(std::uint32_t bin) noexcept {
  const std::uint64_t bit = std::uint64_t{1} << (bin % 64);
  if ((marked_[bin / 64] & bit) != 0) return;
  marked_[bin / 64] |= bit;
  new (&sums_[bin]) LeafSums();
  new (&guesses_[bin]) Overlap();
}

LeafBinning ContactBins::touch(int level_a, const std::uint32_t* a, int level_b,
                               const std::uint32_t* b, std::size_t n) noexcept {
  const std::uint32_t* const nodes = of_b_ ? b : a;
  const int shift = 4 * (level_ - (of_b_ ? level_b : level_a));
  for (std::size_t i = 0; i < n; ++i) mark(nodes[i] >> shift);
  return {sums_.get(), nodes, shift};
}

void ContactBins::add_guess(int level_a, std::uint32_t a, int level_b, std::uint32_t b,
                            const Overlap& guess) noexcept {
  const int at = of_b_ ? level_b : level_a;
  const std::uint32_t block = of_b_ ? b : a;
  const std::uint32_t bin =
      at >= level_ ? block << (4 * (at - level_)) : block >> (4 * (level_ - at));
  mark(bin);
  guesses_[bin].add(guess);
}

void ContactBins::forget_sums() noexcept {
  for_each_bit(marked_, [&](std::uint32_t bin) { sums_[bin] = LeafSums(); });
}

std::uint32_t ContactBins::collect(Precision precision) noexcept {
  std::uint32_t count = 0;
  for_each_bit(marked_, [&](std::uint32_t node) {
    ContactBin bin{node, finish(sums_[node], precision), 0, Eigen::Vector3d::Zero()};
    bin.sum.add(guesses_[node]);
    bin.pull = bin.sum.force.norm();
    if (bin.sum.volume > 0) bin.centre = bin.sum.moment / bin.sum.volume;
    if (bin.sum.volume > 0 || bin.pull > 0) new (&bins_[count++]) ContactBin(bin);
  });
  return count;
}

}  // namespace ist
