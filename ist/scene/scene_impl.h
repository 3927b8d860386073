#pragma once

#include <ist/scene.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <unordered_map>
#include <utility>

#include "query/base/batch.h"
#include "scene/body_box.h"
#include "scene/box_tree.h"

namespace ist {

constexpr std::uint32_t kNone = BoxTree::kNone;

inline std::uint64_t key_of(std::uint32_t a, std::uint32_t b) noexcept {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}
inline ScenePairName name_of(std::uint64_t key) noexcept {
  return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

struct Scene::Impl {
  struct Body {
    SceneBody given;
    BodyBox kept;
    Place place = Place::free;
  };
  /// What is asked of a body for every box that its own meets.
  struct Filtered {
    std::uint32_t number = 0, group = 0, layers = 0, meets = 0;
    bool moves = false, is_field = false;
    bool moved = false;  ///< or added, since the last step
  };

  /// Two bodies of which one moved whose boxes meet.
  struct Found {
    std::uint64_t key;      ///< numbers, the lower one first
    std::uint32_t body[2];  ///< indices, of the lower number first
  };

  /// Two bodies whose boxes meet.
  struct Candidate {
    std::uint64_t key;           ///< numbers, the lower one first
    std::uint32_t body[2];       ///< indices, of the lower number first
    std::uint32_t slot = kNone;  ///< of its answer; kNone: there is none
    std::uint32_t patches = 0;
    YesNo overlapping = YesNo::unknown;
    bool meet = false;
    bool stays = false;  ///< no body moved since the step before
  };

  explicit Impl(const SceneSettings& given)
      : settings(given), still(given.max_bodies), moving(given.max_bodies) {
    bodies.reserve(given.max_bodies);
    filtered.reserve(given.max_bodies);
    index_of.reserve(given.max_bodies);
    take_room(given.max_bodies);
    for (auto* const list : {&now, &before, &fresh}) list->reserve(given.max_pairs);
    for (auto* const list : {&found, &sorted}) list->reserve(given.max_pairs);
    pairs.reserve(given.max_pairs);
    penetrations.reserve(given.max_pairs);
    separations.reserve(given.max_pairs);
    free_slots.reserve(given.max_pairs);
    ended.reserve(given.max_pairs);
    workspaces.reserve(given.workers);
    for (std::size_t i = 0; i < given.workers; ++i)
      workspaces.emplace_back(given.workspace_capacity);
  }

  /// For as many bodies, also those that were removed since the last step.
  void take_room(std::size_t most) {
    for (auto* const list : {&free_bodies, &moved, &endless, &refused, &refused_bodies})
      list->reserve(most);
    still.take_room(most);
    moving.take_room(most);
  }

  SceneRule& rule_of(std::uint32_t i, std::uint32_t j) noexcept {
    return rules[filtered[i].group * kSceneGroups + filtered[j].group];
  }
  Body* find(std::uint32_t number) noexcept {
    const auto found = index_of.find(number);
    return found == index_of.end() ? nullptr : &bodies[found->second];
  }
  std::uint32_t index(const Body& body) const noexcept {
    return static_cast<std::uint32_t>(&body - bodies.data());
  }
  BoxTree& tree_of(const Body& body) noexcept { return body.given.moves ? moving : still; }

  void note_moved(Body& body) noexcept {
    const std::uint32_t i = index(body);
    if (!std::exchange(filtered[i].moved, true)) moved.push_back(i);
  }

  std::vector<std::uint32_t>* list_of(Place place) noexcept {
    return place == Place::endless ? &endless : place == Place::refused ? &refused_bodies : nullptr;
  }

  void take_out(Body& body) noexcept {
    if (body.place == Place::tree) tree_of(body).remove(index(body));
    if (auto* const list = list_of(body.place))
      list->erase(std::find(list->begin(), list->end(), index(body)));
    body.place = Place::free;
  }

  static const Pose& pose_of(const Body& body) noexcept {
    return std::visit([](const auto& placed) -> const Pose& { return placed.pose; },
                      body.given.solid.placed);
  }

  /// Puts a body where it stands. `at_once`: its hierarchy is refitted afterwards.
  void place(Body& body, bool at_once) noexcept {
    SceneBox box;
    const Place place = body.kept.place(pose_of(body), widths, body.given.motion, box);
    put_down(body, at_once, place, box);
  }
  void put_down(Body& body, bool at_once, Place place, const SceneBox& box) noexcept {
    note_moved(body);
    if (place == Place::tree && body.place == Place::tree) {
      if (at_once)
        tree_of(body).put(index(body), box);
      else
        tree_of(body).move(index(body), box);
      return;
    }
    take_out(body);
    body.place = place;
    if (place == Place::tree)
      tree_of(body).add(index(body), box);
    else
      list_of(place)->push_back(index(body));
  }
  void place_all() noexcept {
    for (const auto& [number, at] : index_of) place(bodies[at], true);
    still.refit();
    moving.refit();
  }

  /// set(body, values[i]) of each that there is. Returns how many.
  template <class Values, class Set>
  std::size_t set_all(std::span<const std::uint32_t> numbers, const Values& values,
                      const Set& set) noexcept {
    const std::size_t count = std::min(numbers.size(), values.size());
    const bool at_once = 8 * count > index_of.size();
    std::size_t done = 0, waiting = 0;
    Body* of[BodyBlock::kCount];
    BodyBlock block;
    for (std::size_t i = 0; i < count; ++i) {
      Body* const body = find(numbers[i]);
      if (body == nullptr) continue;
      set(body->given, values[i]);
      ++done;
      if (!body->kept.put(block, waiting, pose_of(*body), widths)) {
        place(*body, at_once);
        continue;
      }
      of[waiting++] = body;
      if (waiting < BodyBlock::kCount) continue;
      place_boxes(block);
      for (std::size_t k = 0; k < waiting; ++k)
        put_down(*of[k], at_once, block.placed >> k & 1 ? Place::tree : Place::refused,
                 {{block.low[0][k], block.low[1][k], block.low[2][k]},
                  {block.high[0][k], block.high[1][k], block.high[2][k]}});
      waiting = 0;
    }
    for (std::size_t k = 0; k < waiting; ++k) place(*of[k], at_once);
    if (at_once) {
      still.refit();
      moving.refit();
    }
    return done;
  }

  bool may_meet(std::uint32_t i, std::uint32_t j) noexcept {
    const Filtered &a = filtered[i], &b = filtered[j];
    if (!(a.moves || b.moves) || (a.layers & b.meets) == 0 || (b.layers & a.meets) == 0 ||
        (a.is_field && b.is_field) || rule_of(i, j).answer == SceneAnswer::nothing)
      return false;
    if (!excluded.empty() &&
        std::binary_search(excluded.begin(), excluded.end(), key_of(a.number, b.number)))
      return false;
    return filter == nullptr ||
           filter(context, std::min(a.number, b.number), std::max(a.number, b.number));
  }

  void note(std::uint32_t i, std::uint32_t j) noexcept {
    if ((!filtered[i].moved && !filtered[j].moved) || !may_meet(i, j)) return;
    if (found.size() + now.size() >= settings.max_pairs &&
        found.size() + count_kept() == settings.max_pairs) {
      exceeded = true;
      return;
    }
    const std::uint32_t a = filtered[i].number, b = filtered[j].number;
    found.push_back({key_of(a, b), {a < b ? i : j, a < b ? j : i}});
  }

  /// Pairs of which a body moved whose boxes meet.
  void find_candidates() noexcept {
    const auto both = [&](std::uint32_t i, std::uint32_t j) { note(i, j); };
    if (8 * moved.size() > still.size() + moving.size()) {
      moving.pairs_with(moving, both);
      moving.pairs_with(still, both);
    } else {
      constexpr std::size_t kTogether = 64;
      std::uint32_t of[kTogether];
      SceneBox boxes[kTogether];
      std::size_t count = 0;
      const auto ask = [&] {
        const auto visit = [&](std::uint32_t k, std::uint32_t j) {
          // Two that moved find each other; two that cannot move are no pair.
          if (j != of[k] && (!filtered[j].moved || of[k] < j)) note(of[k], j);
        };
        moving.each_meeting(std::span(boxes, count), visit);
        still.each_meeting(std::span(boxes, count), visit);
        count = 0;
      };
      for (const std::uint32_t i : moved) {
        if (bodies[i].place != Place::tree) continue;
        of[count] = i;
        boxes[count++] = tree_of(bodies[i]).box_of(i);
        if (count == kTogether) ask();
      }
      ask();
    }
    for (const std::uint32_t i : endless) {
      if (filtered[i].moved) {
        for (std::uint32_t j = 0; j < bodies.size(); ++j) {
          const Body& other = bodies[j];
          // Two that moved find each other.
          if (other.place == Place::tree ||
              (other.place == Place::endless && j != i && (!filtered[j].moved || i < j)))
            note(i, j);
        }
        continue;
      }
      for (const std::uint32_t j : moved)
        if (bodies[j].place == Place::tree) note(i, j);
    }
  }

  bool is_kept(const Candidate& two) const noexcept {
    return !filtered[two.body[0]].moved && !filtered[two.body[1]].moved;
  }

  /// Pairs of the step before of which no body moved: their answers stay.
  std::size_t count_kept() noexcept {
    if (!kept)
      kept = static_cast<std::size_t>(std::count_if(
          now.begin(), now.end(), [&](const Candidate& two) { return is_kept(two); }));
    return *kept;
  }

  /// A place for an answer; those of before are used again.
  std::uint32_t take_slot() noexcept {
    if (free_slots.empty()) {
      penetrations.emplace_back();
      separations.emplace_back();
      return static_cast<std::uint32_t>(penetrations.size() - 1);
    }
    const std::uint32_t slot = free_slots.back();
    free_slots.pop_back();
    return slot;
  }
  void give_back(Candidate& two) noexcept {
    if (two.slot != kNone) free_slots.push_back(std::exchange(two.slot, kNone));
  }

  void answer(Candidate& two, Workspace& workspace) noexcept {
    const Body &a = bodies[two.body[0]], &b = bodies[two.body[1]];
    const PlacedSolid &solid_a = a.given.solid, &solid_b = b.given.solid;
    const SceneRule& rule = rule_of(two.body[0], two.body[1]);
    if (rule.answer == SceneAnswer::overlap) {
      const YesNoAnswer found = rule.margin > 0 ? overlap(solid_a, solid_b, rule.margin, workspace)
                                                : overlap(solid_a, solid_b, workspace);
      two.overlapping = found.answer;
      two.meet = two.overlapping != YesNo::no;
    }
    if (two.slot == kNone) return;
    Penetration& p = penetrations[two.slot];
    Separation& s = separations[two.slot];
    p = {};
    s = {};
    if (!impacts.empty()) impacts[two.slot] = {};
    if (rule.answer == SceneAnswer::impact) {
      const TimeOfImpact found = time_of_impact(solid_a, solid_b, {a.given.motion, b.given.motion},
                                                rule.impact, workspace);
      impacts[two.slot] = found;
      two.meet = found.kind != ImpactKind::no_impact || found.status != QueryStatus::ok;
      return;
    }
    if (rule.answer == SceneAnswer::patches) {
      const ContactPatches found =
          contact_patches(solid_a, solid_b, rule.penetration, workspace,
                          {patches.data() + std::size_t{two.slot} * settings.patches_per_pair,
                           settings.patches_per_pair});
      p = found.penetration;
      two.patches = static_cast<std::uint32_t>(found.count);
    } else {
      p = ist::penetration(solid_a, solid_b, rule.penetration, workspace);
    }
    two.meet = p.status != QueryStatus::ok || p.volume > 0 || p.touching;
    if (rule.margin > 0 && (std::isnan(p.volume) || p.volume == 0)) {
      s = ist::separation(solid_a, solid_b, {.max_distance = rule.margin}, workspace);
      two.meet = two.meet || s.status != QueryStatus::ok || s.distance_min < rule.margin;
    }
  }

  /// By key, digit by digit of those in which keys differ.
  void sort_found() noexcept {
    constexpr std::size_t kFew = 64;
    if (found.size() < kFew) {
      std::sort(found.begin(), found.end(),
                [](const Found& x, const Found& y) { return x.key < y.key; });
      return;
    }
    std::uint64_t differ = 0;
    for (const Found& two : found) differ |= two.key ^ found[0].key;
    sorted.resize(found.size());
    constexpr int kDigit = 11;
    for (int shift = 0; differ >> shift != 0; shift += kDigit) {
      shift += std::countr_zero(differ >> shift);
      const auto digit = [&](const Found& two) {
        return static_cast<std::size_t>(two.key >> shift & ((1u << kDigit) - 1));
      };
      std::uint32_t ends[(1u << kDigit) + 1] = {};
      for (const Found& two : found) ++ends[digit(two) + 1];
      for (std::size_t i = 1; i < 1u << kDigit; ++i) ends[i] += ends[i - 1];
      for (const Found& two : found) sorted[ends[digit(two)]++] = two;
      std::swap(found, sorted);
      if (shift + kDigit >= 64) break;
    }
  }

  /// Answers the pairs of which a body moved.
  void ask_found(const ParallelFor& parallel) noexcept {
    sort_found();
    fresh.clear();
    bool asks = false;
    for (const Found& two : found) {
      const SceneAnswer asked = rule_of(two.body[0], two.body[1]).answer;
      Candidate& made = fresh.emplace_back(Candidate{two.key, {two.body[0], two.body[1]}});
      made.meet = asked == SceneAnswer::boxes;
      if (asked > SceneAnswer::overlap) made.slot = take_slot();
      asks |= asked != SceneAnswer::boxes;
    }
    if (asks)
      answer_all(fresh.size(), workspaces.size(), parallel,
                 [&](std::size_t i, std::size_t worker) { answer(fresh[i], workspaces[worker]); });
  }

  SceneStep step(const ParallelFor& parallel) noexcept {
    still.settle();
    moving.settle();
    SceneStep out;
    refused.clear();
    for (const std::uint32_t i : refused_bodies) refused.push_back(bodies[i].given.number);
    std::sort(refused.begin(), refused.end());
    out.refused = refused;
    kept.reset();
    found.clear();
    exceeded = false;
    find_candidates();
    if (exceeded) {
      out.boxes_met = count_kept() + found.size();
      // What moved is asked in the next step.
      out.pairs_exceeded = true;
      return out;
    }
    std::size_t gone = 0;
    for (Candidate& two : now)
      if (!(two.stays = is_kept(two))) {
        give_back(two);
        ++gone;
      }
    out.boxes_met = now.size() - gone + found.size();
    if (gone > 0 || !found.empty()) {
      ask_found(parallel);
      merge();
    } else {
      for (ScenePair& pair : pairs) pair.event = SceneEvent::stays;
      ended.clear();
    }
    for (const std::uint32_t i : moved) {
      filtered[i].moved = false;
      if (bodies[i].place == Place::free) free_bodies.push_back(i);
    }
    moved.clear();
    out.pairs = pairs;
    out.ended = ended;
    return out;
  }

  /// Merges the pairs that stay with those that were asked: all, those that meet, those that ended.
  void merge() noexcept {
    std::swap(now, before);
    now.clear();
    pairs.clear();
    ended.clear();
    const auto go_on = [&](const Candidate& two, bool met) {
      now.push_back(two);
      if (two.meet)
        pairs.push_back({name_of(two.key).a, name_of(two.key).b,
                         met ? SceneEvent::stays : SceneEvent::begins, two.overlapping, two.slot,
                         two.patches});
      else if (met)
        ended.push_back(name_of(two.key));
    };
    auto old = before.begin();
    const auto pass = [&](std::uint64_t key) {
      for (; old != before.end() && old->key < key; ++old) {
        if (old->stays)
          go_on(*old, old->meet);
        else if (old->meet)
          ended.push_back(name_of(old->key));
      }
    };
    for (Candidate& two : fresh) {
      pass(two.key);
      const bool both = old != before.end() && old->key == two.key;
      if (!two.meet) give_back(two);
      go_on(two, both && old->meet);
      if (both) ++old;
    }
    pass(~std::uint64_t{0});
  }

  /// visit(index) of bodies without a box, and of those whose boxes enter(box) lets in.
  template <class Enter, class Visit>
  void each_body(const Enter& enter, const Visit& visit) const noexcept {
    for (const std::uint32_t i : endless) visit(i);
    still.each(enter, visit);
    moving.each(enter, visit);
  }

  SceneSettings settings;
  std::array<SceneRule, kSceneGroups * kSceneGroups> rules;
  BoxWidths widths = {.by_spheres = true};  ///< as the rules need
  BoxTree still, moving;
  std::vector<Body> bodies;
  std::vector<Filtered> filtered;  ///< by index, as `bodies`
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  std::vector<std::uint32_t> free_bodies, moved, endless, refused_bodies, refused;
  std::vector<std::uint64_t> excluded;
  bool (*filter)(const void*, std::uint32_t, std::uint32_t) noexcept = nullptr;
  const void* context = nullptr;
  std::vector<Found> found, sorted;
  std::vector<Candidate> now, before, fresh;
  std::optional<std::size_t> kept;  ///< count_kept(), once it is asked in a step
  std::vector<ScenePair> pairs;
  std::vector<Penetration> penetrations;  ///< by slot, as the three below
  std::vector<Separation> separations;
  std::vector<ContactPatch> patches;  ///< once a rule asks for them, as impacts
  std::vector<TimeOfImpact> impacts;
  std::vector<std::uint32_t> free_slots;
  std::vector<ScenePairName> ended;
  bool exceeded = false;
  std::deque<std::vector<float>> recorded;  ///< what fields of a record point to
  std::vector<Workspace> workspaces;
};

}  // namespace ist
