#pragma once

#include <ist/scene.h>
#include <algorithm>
#include <bit>
#include <deque>
#include <utility>

#include "query/base/batch.h"
#include "scene/scene_bodies.h"

namespace ist {

inline std::uint64_t key_of(std::uint32_t a, std::uint32_t b) noexcept {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}
inline ScenePairName name_of(std::uint64_t key) noexcept {
  return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

/// The bodies of a scene, their pairs and the answers.
struct Scene::Impl : SceneBodies {
  /// Two bodies whose boxes meet, at least one of which moved.
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

  explicit Impl(const SceneSettings& given) : SceneBodies(given.max_bodies), settings(given) {
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
    note_answers();
  }

  SceneRule& rule_of(std::uint32_t i, std::uint32_t j) noexcept {
    return rules[filtered[i].group * kSceneGroups + filtered[j].group];
  }
  SceneAnswer answer_of(std::uint32_t i, std::uint32_t j) const noexcept {
    return answers[filtered[i].group * kSceneGroups + filtered[j].group];
  }
  /// After rules were set.
  void note_answers() noexcept {
    for (std::size_t k = 0; k < rules.size(); ++k) answers[k] = rules[k].answer;
  }
  bool may_meet(std::uint32_t i, std::uint32_t j) const noexcept {
    const Filtered &a = filtered[i], &b = filtered[j];
    return (static_cast<unsigned>((a.layers & b.meets) != 0) &
            static_cast<unsigned>((b.layers & a.meets) != 0) & (unsigned{a.moves} | b.moves) &
            ~(unsigned{a.is_field} & b.is_field) &
            static_cast<unsigned>(answer_of(i, j) != SceneAnswer::nothing)) != 0;
  }
  /// False if a pair of numbers, a the lower, is excluded or filtered out.
  bool is_let(std::uint32_t a, std::uint32_t b) const noexcept {
    return !std::binary_search(excluded.begin(), excluded.end(), key_of(a, b)) &&
           (filter == nullptr || filter(context, a, b));
  }

  void note(std::uint32_t i, std::uint32_t j) noexcept {
    if (number_of[j] < number_of[i]) std::swap(i, j);
    if ((!every && !has_moved(i) && !has_moved(j)) || !may_meet(i, j) ||
        (picks && !is_let(number_of[i], number_of[j])))
      return;
    if (found.size() >= most_found && found.size() + count_kept() == settings.max_pairs) {
      exceeded = true;
      return;
    }
    found.push_back({key_of(number_of[i], number_of[j]), {i, j}});
  }

  /// note() of at most PairSearch::kMost pairs.
  void note_all(std::span<const BodyPair> some) noexcept {
    if (!every || picks || found.size() + some.size() > most_found) {
      for (const BodyPair& two : some) note(two.a, two.b);
      return;
    }
    Found kept[PairSearch::kMost];
    std::size_t count = 0;
    const std::uint32_t* const number = number_of.data();
    for (const BodyPair& two : some) {
      const bool in_order = number[two.a] < number[two.b];
      const std::uint32_t i = in_order ? two.a : two.b, j = in_order ? two.b : two.a;
      kept[count] = {std::uint64_t{number[i]} << 32 | number[j], {i, j}};
      count += may_meet(i, j);
    }
    found.insert(found.end(), kept, kept + count);
  }

  /// Finds the pairs whose boxes meet and one of whose bodies moved.
  void find_candidates() noexcept {
    every = all_moved();
    picks = !excluded.empty() || filter != nullptr;
    most_found = settings.max_pairs - (every ? 0 : now.size());
    if (many_moved()) {
      const auto visit = [&](std::span<const BodyPair> some) { note_all(some); };
      moving.pairs_with(moving, visit);
      moving.pairs_with(still, visit);
    } else {
      constexpr std::size_t kTogether = 64;
      std::uint32_t of[kTogether];
      SceneBox boxes[kTogether];
      std::size_t count = 0;
      const auto ask = [&] {
        const auto visit = [&](std::uint32_t k, std::uint32_t j) {
          // Two that moved find each other; two that cannot move are no pair.
          if (j != of[k] && (!has_moved(j) || of[k] < j)) note(of[k], j);
        };
        moving.each_meeting(std::span(boxes, count), visit);
        still.each_meeting(std::span(boxes, count), visit);
        count = 0;
      };
      each_moved([&](std::uint32_t i) {
        of[count] = i;
        boxes[count++] = tree_of(i).box_of(i);
        if (count == kTogether) ask();
      });
      ask();
    }
    for (const std::uint32_t i : endless) {
      if (has_moved(i)) {
        for (std::uint32_t j = 0; j < filtered.size(); ++j) {
          const Place other = filtered[j].place;
          // Two that moved find each other.
          if (other == Place::tree ||
              (other == Place::endless && j != i && (!has_moved(j) || i < j)))
            note(i, j);
        }
        continue;
      }
      each_moved([&](std::uint32_t j) { note(i, j); });
    }
  }

  bool is_kept(const Candidate& two) const noexcept {
    return !has_moved(two.body[0]) && !has_moved(two.body[1]);
  }

  /// Counts the pairs of the step before without a moved body: their answers stay.
  std::size_t count_kept() noexcept {
    if (!kept)
      kept = static_cast<std::size_t>(std::count_if(
          now.begin(), now.end(), [&](const Candidate& two) { return is_kept(two); }));
    return *kept;
  }

  /// A slot for an answer; old slots are reused.
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
    const PlacedSolid solid_a = solid_of(two.body[0]), solid_b = solid_of(two.body[1]);
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
    // Matched spheres protrude.
    if (rule.margin > 0 &&
        (rule.penetration.measure == Measure::matched || std::isnan(p.volume) || p.volume == 0)) {
      s = ist::separation(solid_a, solid_b, {.max_distance = rule.margin}, workspace);
      two.meet = two.meet || s.status != QueryStatus::ok || s.distance_min < rule.margin;
    }
  }

  /// Sorts by key, digit by digit of those in which keys differ.
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
    // Many are sorted by one number of a pair at once.
    constexpr int kFewest = 8, kMost = 13;
    const int bits = found.size() < 4096
                         ? kFewest
                         : std::clamp<int>(std::bit_width(name_of(differ).b), kFewest, kMost);
    std::uint32_t ends[(1u << kMost) + 1];
    for (int shift = 0; differ >> shift != 0; shift += bits) {
      shift += std::countr_zero(differ >> shift);
      const auto digit = [&](const Found& two) {
        return static_cast<std::size_t>(two.key >> shift & ((1u << bits) - 1));
      };
      std::fill(ends, ends + (1u << bits) + 1, 0);
      for (const Found& two : found) ++ends[digit(two) + 1];
      for (std::size_t i = 1; i < 1u << bits; ++i) ends[i] += ends[i - 1];
      for (const Found& two : found) sorted[ends[digit(two)]++] = two;
      std::swap(found, sorted);
      if (shift + bits >= 64) break;
    }
  }

  /// Answers the pairs with a moved body.
  void ask_found(const ParallelFor& parallel) noexcept {
    sort_found();
    fresh.clear();
    bool asks = false;
    for (const Found& two : found) {
      const SceneAnswer asked = answer_of(two.body[0], two.body[1]);
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
    for (const std::uint32_t i : refused_bodies) refused.push_back(number_of[i]);
    std::sort(refused.begin(), refused.end());
    out.refused = refused;
    kept.reset();
    found.clear();
    exceeded = false;
    find_candidates();
    if (exceeded) {
      out.boxes_met = count_kept() + found.size();
      // Moved bodies are queried in the next step.
      out.pairs_exceeded = true;
      return out;
    }
    std::size_t gone = 0;
    const bool none_stays = every;
    for (Candidate& two : now)
      if (!(two.stays = !none_stays && is_kept(two))) {
        give_back(two);
        ++gone;
      }
    out.boxes_met = now.size() - gone + found.size();
    if (gone > 0 || !found.empty()) {
      ask_found(parallel);
      merge(gone < now.size());
    } else {
      for (ScenePair& pair : pairs) pair.event = SceneEvent::stays;
      ended.clear();
    }
    forget_moved();
    free_bodies.insert(free_bodies.end(), removed.begin(), removed.end());
    removed.clear();
    out.pairs = pairs;
    out.ended = ended;
    return out;
  }

  /// Merges the pairs that stay, if any, with the queried ones: all, those that meet, and those
  /// that ended.
  void merge(bool some_stay) noexcept {
    std::swap(now, before);
    now.clear();
    pairs.clear();
    ended.clear();
    const auto go_on = [&](const Candidate& two, bool met) {
      if (some_stay) now.push_back(two);
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
    if (!some_stay) std::swap(now, fresh);
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
  std::array<SceneAnswer, kSceneGroups * kSceneGroups> answers;  ///< of the rules
  std::vector<std::uint64_t> excluded;
  bool (*filter)(const void*, std::uint32_t, std::uint32_t) noexcept = nullptr;
  const void* context = nullptr;
  std::vector<Found> found, sorted;
  std::vector<Candidate> now, before, fresh;
  std::optional<std::size_t> kept;  ///< count_kept(), once computed in a step
  std::vector<ScenePair> pairs;
  std::vector<Penetration> penetrations;  ///< by slot, as the three below
  std::vector<Separation> separations;
  std::vector<ContactPatch> patches;  ///< if a rule requests them; impacts likewise
  std::vector<TimeOfImpact> impacts;
  std::vector<std::uint32_t> free_slots;
  std::vector<ScenePairName> ended;
  // State of a search for pairs:
  bool every = false;          ///< all bodies moved
  bool picks = false;          ///< some pairs are excluded, or there is a filter
  std::size_t most_found = 0;  ///< fewer pairs are not too many
  bool exceeded = false;
  std::deque<std::vector<float>> recorded;  ///< the data of a record's shapes
  std::vector<Workspace> workspaces;
};

}  // namespace ist
