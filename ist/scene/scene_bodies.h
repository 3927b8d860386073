#pragma once

#include <ist/scene.h>
#include <algorithm>
#include <bit>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "base/bits.h"
#include "scene/body_box.h"
#include "scene/box_tree.h"

namespace ist {

constexpr std::uint32_t kNone = BoxTree::kNone;
constexpr std::uint32_t kCount = BodyBlock::kCount;

/// The bodies of a scene and their boxes in two hierarchies: of those that move, and of the others.
struct SceneBodies {
  struct Body {
    SceneBody given;  ///< without its pose, which is in its block
    BodyBox kept;
  };
  /// The data of a body needed for every box that its own meets.
  struct Filtered {
    std::uint32_t layers = 0, meets = 0;
    std::uint8_t group = 0;
    bool moves = false, is_field = false;
    Place place = Place::free;
  };
  /// States of a block's bodies, a bit each.
  struct Lanes {
    std::uint8_t in_vectors = 0;  ///< place_boxes() computes their boxes
    std::uint8_t moving = 0;      ///< their boxes are in that hierarchy, as in `still`
    std::uint8_t still = 0;
    std::uint8_t waiting = 0;  ///< for put_waiting()
    std::uint8_t moved = 0;    ///< or added, since the last step
  };

  explicit SceneBodies(std::size_t most) : still(most), moving(most) {
    index_of.reserve(most);
    take_room(most);
  }

  /// Reserves memory for `most` bodies, including those removed since the last step.
  void take_room(std::size_t most) {
    bodies.reserve(most);
    const std::size_t of_eight = (most + kCount - 1) / kCount;
    number_of.reserve(kCount * of_eight);
    filtered.reserve(kCount * of_eight);
    blocks.reserve(of_eight);
    lanes.reserve(of_eight);
    for (auto* const list : {&free_bodies, &removed, &endless, &refused, &refused_bodies})
      list->reserve(most);
    for (auto* const list : {&waiting, &moved}) list->reserve(of_eight);
    still.take_room(most);
    moving.take_room(most);
  }

  bool is_at(std::uint32_t i, std::uint32_t number) const noexcept {
    return number_of[i] == number && filtered[i].place != Place::free;
  }
  /// True if a block's bodies have these numbers, in order.
  bool is_full(std::uint32_t first, const std::uint32_t* numbers) const noexcept {
    const Lanes& all = lanes[first / kCount];
    return (all.moving | all.still) == (1u << kCount) - 1 &&
           std::memcmp(numbers, number_of.data() + first, kCount * sizeof *numbers) == 0;
  }
  /// The index of a body, kNone if there is none; quick if it is `guess`.
  std::uint32_t find(std::uint32_t number, std::uint32_t guess = kNone) const noexcept {
    if (guess < number_of.size() && is_at(guess, number)) return guess;
    const auto found = index_of.find(number);
    return found == index_of.end() ? kNone : found->second;
  }
  BoxTree& tree_of(std::uint32_t i) noexcept { return filtered[i].moves ? moving : still; }
  Pose pose_of(std::uint32_t i) const noexcept { return blocks[i / kCount].pose(i % kCount); }
  PlacedSolid solid_of(std::uint32_t i) const noexcept {
    PlacedSolid out = bodies[i].given.solid;
    std::visit([&](auto& placed) { placed.pose = pose_of(i); }, out.placed);
    return out;
  }

  /// Some of a block's.
  void note_moved(std::uint32_t block, std::uint32_t of) noexcept {
    Lanes& all = lanes[block];
    if (all.moved == 0) moved.push_back(block);
    moved_count += static_cast<std::size_t>(std::popcount(of & ~std::uint32_t{all.moved}));
    all.moved = static_cast<std::uint8_t>(all.moved | of);
  }
  void note_moved(std::uint32_t i) noexcept { note_moved(i / kCount, 1u << i % kCount); }
  bool has_moved(std::uint32_t i) const noexcept {
    return (lanes[i / kCount].moved >> i % kCount & 1) != 0;
  }
  /// True if they are more than an eighth.
  bool many_moved() const noexcept { return 8 * moved_count > still.size() + moving.size(); }
  bool all_moved() const noexcept { return removed.empty() && moved_count == index_of.size(); }
  void forget_moved() noexcept {
    for (const std::uint32_t block : moved) lanes[block].moved = 0;
    moved.clear();
    moved_count = 0;
  }
  /// visit(index) of bodies that moved and have a box.
  template <class Visit>
  void each_moved(const Visit& visit) noexcept {
    for (const std::uint32_t block : moved)
      for (std::uint32_t of = lanes[block].moved; of != 0; of &= of - 1) {
        const auto i = kCount * block + static_cast<std::uint32_t>(std::countr_zero(of));
        if (filtered[i].place == Place::tree) visit(i);
      }
  }

  std::vector<std::uint32_t>* list_of(Place place) noexcept {
    return place == Place::endless ? &endless : place == Place::refused ? &refused_bodies : nullptr;
  }

  void take_out(std::uint32_t i) noexcept {
    const Place place = std::exchange(filtered[i].place, Place::free);
    if (place == Place::tree) {
      tree_of(i).remove(i);
      Lanes& all = lanes[i / kCount];
      (filtered[i].moves ? all.moving : all.still) &=
          static_cast<std::uint8_t>(~(1u << i % kCount));
    }
    if (auto* const list = list_of(place)) list->erase(std::find(list->begin(), list->end(), i));
  }

  /// put_waiting() must follow, which updates the bodies' boxes.
  void wait(std::uint32_t block, std::uint32_t of) noexcept {
    Lanes& all = lanes[block];
    if (all.waiting == 0) waiting.push_back(block);
    all.waiting = static_cast<std::uint8_t>(all.waiting | of);
  }
  void put_waiting(bool at_once) noexcept {
    for (const std::uint32_t block : waiting)
      put(block, std::exchange(lanes[block].waiting, std::uint8_t{0}), at_once);
    waiting.clear();
    if (!at_once) return;
    still.refit();
    moving.refit();
  }
  /// `at_once`: hierarchies are refitted afterwards.
  void put(std::uint32_t b, std::uint32_t left, bool at_once) noexcept {
    const BodyBlock& block = blocks[b];
    const Lanes& all = lanes[b];
    const std::uint32_t quick = left & all.in_vectors;
    note_moved(b, left);
    BlockBoxes boxes;
    if (quick != 0) place_boxes(block, quick, boxes);
    if (at_once) {
      const std::uint32_t stay = quick & boxes.placed;
      moving.put(kCount * b, stay & all.moving, boxes.low, boxes.high);
      still.put(kCount * b, stay & all.still, boxes.low, boxes.high);
      left &= ~(stay & (all.moving | all.still));
    }
    for (const std::uint32_t k : set_bits(left)) {
      const Body& body = bodies[kCount * b + k];
      SceneBox box;
      Place place = (boxes.placed >> k & 1) != 0 ? Place::tree : Place::refused;
      if ((quick >> k & 1) != 0)
        box = boxes.box(k);
      else
        place = body.kept.place(block.pose(k), widths, body.given.motion, box);
      put_down(kCount * b + k, place, box);
    }
  }
  void put_down(std::uint32_t i, Place place, const SceneBox& box) noexcept {
    if (place == Place::tree && filtered[i].place == Place::tree) {
      tree_of(i).move(i, box);
      return;
    }
    take_out(i);
    filtered[i].place = place;
    if (place == Place::tree) {
      tree_of(i).add(i, box);
      Lanes& all = lanes[i / kCount];
      (filtered[i].moves ? all.moving : all.still) |= static_cast<std::uint8_t>(1u << i % kCount);
    } else {
      list_of(place)->push_back(i);
    }
  }
  /// Writes the part of body i's box that does not change with its pose.
  void prepare(std::uint32_t i) noexcept {
    const std::uint32_t k = i % kCount;
    Lanes& all = lanes[i / kCount];
    const bool quick = bodies[i].kept.put(blocks[i / kCount], k, widths);
    all.in_vectors =
        static_cast<std::uint8_t>((all.in_vectors & ~(1u << k)) | unsigned{quick} << k);
    wait(i / kCount, 1u << k);
  }
  void prepare_all() noexcept {
    for (const auto& [number, i] : index_of) prepare(i);
    put_waiting(true);
  }

  /// Calls set(block, lane, index, count) for the rows of existing bodies; returns their number.
  template <class Set>
  std::size_t each_row(std::span<const std::uint32_t> numbers, const Set& set) noexcept {
    std::size_t done = 0;
    std::uint32_t at = 0;
    for (std::size_t i = 0; i < numbers.size();) {
      // In a row, as far as its block goes.
      std::uint32_t row = kCount;
      if (i + kCount > numbers.size() || at % kCount != 0 || at >= number_of.size() ||
          !is_full(at, numbers.data() + i)) {
        at = find(numbers[i], at);
        if (at == kNone) {
          ++i;
          continue;
        }
        const std::size_t most = std::min<std::size_t>(kCount - at % kCount, numbers.size() - i);
        for (row = 1; row < most && is_at(at + row, numbers[i + row]);) ++row;
      }
      const std::uint32_t k = at % kCount;
      set(at / kCount, k, i, row);
      at += row;
      i += row;
      done += row;
    }
    return done;
  }
  std::size_t set_poses(std::span<const std::uint32_t> numbers, const Pose* poses) noexcept {
    constexpr std::uint32_t kAll = (1u << kCount) - 1;
    const bool at_once = 8 * numbers.size() > index_of.size();
    const std::size_t done = each_row(
        numbers, [&](std::uint32_t b, std::uint32_t k, std::size_t i, std::uint32_t count) {
          const Lanes& all = lanes[b];
          if (at_once && count == kCount && all.in_vectors == kAll &&
              (all.moving == kAll || all.still == kAll) &&
              (all.moving == kAll ? moving : still).put_poses(kCount * b, blocks[b], poses + i)) {
            note_moved(b, kAll);
            return;
          }
          for (std::uint32_t r = 0; r < count; ++r) blocks[b].set_pose(k + r, poses[i + r]);
          wait(b, ((1u << count) - 1) << k);
        });
    put_waiting(at_once);
    return done;
  }
  std::size_t set_motions(std::span<const std::uint32_t> numbers, const Motion* motions) noexcept {
    const std::size_t done = each_row(
        numbers, [&](std::uint32_t b, std::uint32_t k, std::size_t i, std::uint32_t count) {
          for (std::uint32_t r = 0; r < count; ++r)
            bodies[kCount * b + k + r].given.motion = motions[i + r];
          wait(b, ((1u << count) - 1) << k);
        });
    put_waiting(8 * numbers.size() > index_of.size());
    return done;
  }

  BoxWidths widths = {.by_spheres = true};  ///< as the rules need
  BoxTree still, moving;
  std::vector<Body> bodies;
  /// By index, as `bodies`, and to the end of their block.
  std::vector<std::uint32_t> number_of;
  std::vector<Filtered> filtered;
  std::vector<BodyBlock> blocks;  ///< eight bodies each, as in `lanes`
  std::vector<Lanes> lanes;
  std::vector<std::uint32_t> waiting, moved;  ///< blocks that have such lanes
  std::size_t moved_count = 0;                ///< bodies, including removed ones
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  std::vector<std::uint32_t> free_bodies, removed, endless, refused_bodies;
  std::vector<std::uint32_t> refused;  ///< numbers of those, sorted in a step
};

}  // namespace ist
