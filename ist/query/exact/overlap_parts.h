#pragma once

#include <cstdint>

#include "query/exact/overlap_joins.h"

// The connected parts of an overlap, on the host and on a GPU.

namespace ist {

/// The parts of an overlap, their names and sums.
template <class Overlap>
class OverlapParts : public OverlapJoins<Overlap> {
  using Joins = OverlapJoins<Overlap>;

 public:
  using Joins::Joins;

  /// Divides the overlap. Returns how many parts there are, at most PartMemory::most_parts (all
  /// further ones are in the last): PartMemory::parts, by their first crossings.
  IST_HD std::uint32_t divide() noexcept {
    start(false);
    this->join();
    name_parts();
    one_ = are_one();
    return finish();
  }

  /// The part of crossing i in the order of sums.
  IST_HD std::uint32_t part_of_crossing(std::uint32_t i) noexcept {
    return memory().parts[part_of(i)].kept;
  }

 protected:
  using Joins::block_element;
  using Joins::block_of;
  using Joins::lane;
  using Joins::leads;
  using Joins::load;
  using Joins::meet;
  using Joins::memory;
  using Joins::mesh;
  using Joins::opposite_edge;
  using Joins::pieces;
  using Joins::records;
  using Joins::root;
  using Joins::top;
  using Joins::vertex_element;
  using Joins::width;

  /// `one`: everything that counts is known to be one part.
  IST_HD void start(bool one) noexcept {
    parts_ = 0;
    one_ = one;
    this->number_elements();
  }

  /// Numbers the parts that have crossings by their first ones, which are their roots.
  IST_HD void name_parts() noexcept {
    const std::uint32_t last = memory().most_parts - 1, n = one_ ? 1 : this->crossings();
    if (one_ && leads()) memory().parts[0] = {};
    for (std::uint32_t first = 0; !one_ && first < n; first += width()) {
      const std::uint32_t i = first + lane();
      int total = 0;
      const bool starts = i < n && this->is_root(i);
      const std::uint32_t number =
          parts_ + static_cast<std::uint32_t>(this->exclusive_count(starts, total));
      if (starts) {
        memory().part[i] = number < last ? number : last;
        if (number <= last) memory().parts[number] = {};
        if (number <= last) memory().parts[number].kept = number;
      }
      parts_ += static_cast<std::uint32_t>(total);
    }
    parts_ = one_ ? 1 : parts_ <= last ? parts_ : last + 1;
    meet();
    for (std::uint32_t i = lane(); i < this->crossings(); i += width()) {
      const std::uint64_t id =
          (std::uint64_t{this->triangle(0, i)} << kTriangleBits | this->triangle(1, i)) + 1;
      lower(memory().parts[part_of(i)].id, id);
    }
    // The lanes find the parts of all elements at once, for the sums.
    for (std::uint32_t r = lane(); width() > 1 && r < records(); r += width())
      for_each_bit(this->inside_of(r), [&](std::uint32_t v) { note_part(vertex_element(r, v)); });
    for (int side = 0; width() > 1 && side < 2; ++side)
      this->for_each_of_lane(side, [&](std::uint32_t b) { note_part(block_element(side, b)); });
    meet();
  }

  /// True if everything that counts is in one part.
  IST_HD bool are_one() noexcept {
    meet();
    if (leads()) pieces().says = parts_ == 1;
    meet();
    if (one_ || !pieces().says) return one_;
    bool one = true;
    const std::uint32_t first = top(0);
    for (std::uint32_t r = lane(); r < records() && one; r += width()) {
      if (this->pierced_of(r) == 0) continue;
      for (std::uint32_t t = 0; one && t < block_of(r).triangles; ++t) {
        if (this->whole_of(r, t) == 0) continue;
        one = top(triangle_element(r, t)) == first;
      }
    }
    for (int side = 0; side < 2; ++side)
      this->for_each_of_lane(
          side, [&](std::uint32_t b) { one = one && top(block_element(side, b)) == first; });
    return !this->any(!one);
  }

  /// Sums the parts and returns their number.
  IST_HD std::uint32_t finish() noexcept {
    meet();
    if (leads()) pieces().says = one_ && this->whole().volume() > 0;
    meet();
    if (!pieces().says)
      sum_parts();
    else if (leads())
      memory().parts[0].sums = this->whole();
    if (leads()) join_cavities();
    return parts_;
  }

  IST_HD std::uint32_t part_of(std::uint32_t element) noexcept {
    if (one_) return 0;
    std::uint32_t& known = memory().part[element];
    if (known != kNoIndex) return known;
    std::uint32_t& part = memory().part[root(element)];
    if (part == kNoIndex) {
      const std::uint32_t last = memory().most_parts - 1;
      part = parts_ < last ? parts_ : last;
      if (part == parts_) {
        memory().parts[part] = {};
        memory().parts[part].kept = part;
        ++parts_;
      }
    }
    return known = part;
  }

  /// The part of an element once parts are summed; kNoIndex if nothing of its part was summed.
  IST_HD std::uint32_t known_part(std::uint32_t element) const noexcept {
    if (one_) return 0;
    const std::uint32_t known = memory().part[element];
    return known != kNoIndex ? known : memory().part[top(element)];
  }

  /// The element to which a triangle of a crossed block belongs if it counts as a whole.
  IST_HD std::uint32_t triangle_element(std::uint32_t r, std::uint32_t t) const noexcept {
    if (one_) return 0;
    const std::uint32_t edge = 3 * t + opposite_edge(r, t);
    if (this->pierced_of(r) >> edge & 1) return memory().middles[this->first_middle(r) + edge];
    return vertex_element(r, block_of(r).corner[edge % 3][t]);
  }

  std::uint32_t parts_ = 0;
  bool one_ = false;  ///< everything that counts is in one part

 private:
  /// Lowers a number; 0 means not yet set.
  IST_HD void lower(std::uint64_t& at, std::uint64_t to) noexcept {
    for (std::uint64_t now = load(at); now == 0 || to < now;) {
      const std::uint64_t before = this->replace(at, now, to);
      if (before == now) return;
      now = before;
    }
  }

  /// Keeps the part of an element if it is known.
  IST_HD void note_part(std::uint32_t element) noexcept {
    const std::uint32_t part = memory().part[root(element)];
    if (part != kNoIndex) memory().part[element] = part;
  }

  /// Finds the parts of eight pieces. element_of(l) is kNoIndex if piece l does not count.
  template <class ElementOf>
  IST_HD void find_parts(std::uint32_t count, const ElementOf& element_of) noexcept {
    bool unknown = false;
    for (std::uint32_t l = lane(); l < count; l += width()) {
      const std::uint32_t element = element_of(l);
      std::uint32_t& part = pieces().part[l];
      part = element == kNoIndex ? kNoIndex : width() == 1 ? part_of(element) : known_part(element);
      unknown = unknown || (element != kNoIndex && part == kNoIndex);
    }
    unknown = this->any(unknown);
    meet();
    if (!unknown) return;
    for (std::uint32_t l = 0; leads() && l < count; ++l)
      if (const std::uint32_t element = element_of(l); element != kNoIndex)
        pieces().part[l] = part_of(element);
    meet();
  }

  /// Adds the terms of eight pieces to their parts in order. Each lane adds one of the numbers.
  template <int kVolumes>
  IST_HD void add_terms(std::uint32_t count) noexcept {
    const ExactTerms& terms = pieces().terms;
    constexpr std::uint32_t kNumbers =
        kVolumes == 1 ? 3 : 9;  // the moment, or also force and torque
    for (std::uint32_t l = 0; l < count; ++l) {
      if (pieces().part[l] == kNoIndex) continue;
      ExactSums& sums = memory().parts[pieces().part[l]].sums;
      if (leads())
        for (int v = 0; v < kVolumes; ++v) sums.six_volumes.add(terms.six_volumes[v][l]);
      for (std::uint32_t k = (lane() + width() - 1) % width(); k < kNumbers; k += width())
        (&sums.moment.x)[k] += (&terms.moment[0][0])[8 * k + l];
    }
    meet();
  }

  IST_HD void sum_parts() noexcept {
    for (std::uint32_t first = 0; first < this->crossings(); first += 8) {
      const std::uint32_t left = this->crossings() - first, count = left < 8 ? left : 8;
      this->find_crossing_terms(first);
      find_parts(count, [&](std::uint32_t l) { return first + l; });
      add_terms<3>(count);
    }
    for (int side = 0; side < 2; ++side) {
      this->for_each_pierced(side, [&](std::uint32_t b) {
        const std::uint32_t r = this->record_of(side, b), all = mesh(side).blocks[b].triangles;
        this->count_triangles(r);
        for (std::uint32_t h = 0; 8 * h < all; ++h) {
          const std::uint32_t left = all - 8 * h, count = left < 8 ? left : 8;
          this->find_triangle_terms(r, h);
          find_parts(count, [&](std::uint32_t l) {
            return pieces().whole[8 * h + l] == 0 ? kNoIndex : triangle_element(r, 8 * h + l);
          });
          add_terms<1>(count);
        }
      });
      std::uint32_t count = 0;
      this->for_each_inside(side, [&](std::uint32_t b) {
        if (leads()) pieces().block[count] = b;
        if (++count == 8) add_blocks(side, count);
      });
      if (count > 0) add_blocks(side, count);
    }
  }
  IST_HD void add_blocks(int side, std::uint32_t& count) noexcept {
    meet();
    for (std::uint32_t l = lane(); l < count; l += width()) {
      const LaneSums found = this->lane_sums(side, pieces().block[l], {0, 0, 0});
      pieces().terms.six_volumes[0][l] = found.six_volumes;
      for (int k = 0; k < 3; ++k) pieces().terms.moment[k][l] = found.moment[k];
    }
    find_parts(count, [&](std::uint32_t l) { return block_element(side, pieces().block[l]); });
    add_terms<1>(count);
    count = 0;
  }

  /// A part with negative volume is the wall of a cavity. It is added to the largest part, the most
  /// likely owner.
  IST_HD void join_cavities() noexcept {
    ExactPart* const parts = memory().parts;
    std::uint32_t largest = 0;
    for (std::uint32_t p = 1; p < parts_; ++p)
      if (parts[p].sums.volume() > parts[largest].sums.volume()) largest = p;
    for (std::uint32_t p = 0; p < parts_; ++p)
      if (parts[p].sums.volume() < 0) parts[p].kept = largest;
  }
};

}  // namespace ist
