#include <ist/scene.h>

#include <ist/error.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "query/base/batch.h"
#include "query/base/relative_pose.h"
#include "scene/body_box.h"
#include "scene/box_tree.h"

namespace ist {

namespace {

constexpr std::uint32_t kNone = BoxTree::kNone;

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) noexcept {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}
ScenePairName name_of(std::uint64_t key) noexcept {
  return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

}  // namespace

struct Scene::Impl {
  struct Body {
    SceneBody given;
    BodyBox kept;
    SceneBox box;
    Place place = Place::free;
    bool moved = false;  ///< or added, since the last step
  };

  /// Two bodies whose boxes meet.
  struct Candidate {
    std::uint64_t key;           ///< numbers, the lower one first
    std::uint32_t body[2];       ///< indices, of the lower number first
    std::uint32_t slot = kNone;  ///< of its answer; kNone: there is none
    std::uint32_t patches = 0;
    Overlapping overlapping = Overlapping::unknown;
    bool meet = false;
  };

  explicit Impl(const SceneSettings& given)
      : settings(given), still(given.max_bodies), moving(given.max_bodies) {
    bodies.reserve(given.max_bodies);
    index_of.reserve(given.max_bodies);
    take_room(given.max_bodies);
    for (auto* const list : {&now, &before, &fresh}) list->reserve(given.max_pairs);
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

  SceneRule& rule_of(const Body& a, const Body& b) noexcept {
    return rules[a.given.group * kSceneGroups + b.given.group];
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
    if (std::exchange(body.moved, true)) return;
    moved.push_back(index(body));
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

  /// Puts a body where it stands. `at_once`: its hierarchy is refitted afterwards.
  void place(Body& body, bool at_once) noexcept {
    note_moved(body);
    const Pose& pose = std::visit([](const auto& placed) -> const Pose& { return placed.pose; },
                                  body.given.solid.placed);
    const auto [place, box] = body.kept.placed(pose, margin, by_spheres);
    body.box = box;
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

  bool may_meet(const Body& a, const Body& b) noexcept {
    if (!a.given.moves && !b.given.moves) return false;
    if ((a.given.layers & b.given.meets) == 0 || (b.given.layers & a.given.meets) == 0)
      return false;
    if (rule_of(a, b).answer == SceneAnswer::nothing) return false;
    if (std::holds_alternative<PlacedField>(a.given.solid.placed) &&
        std::holds_alternative<PlacedField>(b.given.solid.placed))
      return false;
    const std::uint32_t numbers[2] = {a.given.number, b.given.number};
    if (!excluded.empty() &&
        std::binary_search(excluded.begin(), excluded.end(), key_of(numbers[0], numbers[1])))
      return false;
    return filter == nullptr ||
           filter(context, std::min(numbers[0], numbers[1]), std::max(numbers[0], numbers[1]));
  }

  void note(std::uint32_t i, std::uint32_t j) noexcept {
    const Body &a = bodies[i], &b = bodies[j];
    if ((!a.moved && !b.moved) || !may_meet(a, b)) return;
    if (fresh.size() + kept == settings.max_pairs) {
      exceeded = true;
      return;
    }
    const bool in_order = a.given.number < b.given.number;
    fresh.push_back({key_of(a.given.number, b.given.number), {in_order ? i : j, in_order ? j : i}});
  }

  /// Pairs of which a body moved whose boxes meet.
  void find_candidates() noexcept {
    const auto both = [&](std::uint32_t i, std::uint32_t j) { note(i, j); };
    if (8 * moved.size() > still.size() + moving.size()) {
      moving.pairs_within(both);
      moving.pairs_with(still, both);
    } else {
      for (const std::uint32_t i : moved) {
        const Body& body = bodies[i];
        if (body.place != Place::tree) continue;
        const auto enter = [&](const SceneBox& box) { return box.meets(body.box); };
        const auto visit = [&](std::uint32_t j) {
          // Two that moved find each other.
          if (j != i && (!bodies[j].moved || i < j)) note(i, j);
        };
        moving.each(enter, visit);
        if (body.given.moves) still.each(enter, visit);
      }
    }
    for (const std::uint32_t i : endless) {
      if (bodies[i].moved) {
        for (std::uint32_t j = 0; j < bodies.size(); ++j) {
          const Body& other = bodies[j];
          // Two that moved find each other.
          if (other.place == Place::tree ||
              (other.place == Place::endless && j != i && (!other.moved || i < j)))
            note(i, j);
        }
        continue;
      }
      for (const std::uint32_t j : moved)
        if (bodies[j].place == Place::tree) note(i, j);
    }
  }

  bool is_kept(const Candidate& two) const noexcept {
    return !bodies[two.body[0]].moved && !bodies[two.body[1]].moved;
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
    const SceneRule& rule = rule_of(a, b);
    if (rule.answer == SceneAnswer::overlap) {
      two.overlapping = rule.margin > 0 ? overlap(solid_a, solid_b, rule.margin, workspace)
                                        : overlap(solid_a, solid_b, workspace);
      two.meet = two.overlapping != Overlapping::no;
    }
    if (two.slot == kNone) return;
    Penetration& p = penetrations[two.slot];
    Separation& s = separations[two.slot];
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
    s = {};
    two.meet = p.status != QueryStatus::ok || p.volume > 0 || p.touching;
    if (rule.margin > 0 && (std::isnan(p.volume) || p.volume == 0)) {
      SeparationSettings limits;
      limits.max_distance = rule.margin;
      s = ist::separation(solid_a, solid_b, limits, workspace);
      two.meet = two.meet || s.status != QueryStatus::ok || s.distance_min < rule.margin;
    }
  }

  SceneStep step(const ParallelFor& parallel) noexcept {
    still.settle();
    moving.settle();
    SceneStep out;
    refused.clear();
    for (const std::uint32_t i : refused_bodies) refused.push_back(bodies[i].given.number);
    std::sort(refused.begin(), refused.end());
    out.refused = refused;
    // Of bodies that stand still the answers stay.
    kept = static_cast<std::size_t>(
        std::count_if(now.begin(), now.end(), [&](const Candidate& two) { return is_kept(two); }));
    fresh.clear();
    exceeded = false;
    find_candidates();
    out.boxes_met = kept + fresh.size();
    if (exceeded) {
      // What moved is asked in the next step.
      out.pairs_exceeded = true;
      return out;
    }
    std::swap(now, before);
    now.clear();
    for (Candidate& two : before)
      if (!is_kept(two)) give_back(two);
    std::sort(fresh.begin(), fresh.end(),
              [](const Candidate& x, const Candidate& y) { return x.key < y.key; });
    for (Candidate& two : fresh) {
      const SceneAnswer asked = rule_of(bodies[two.body[0]], bodies[two.body[1]]).answer;
      two.meet = asked == SceneAnswer::boxes;
      if (asked > SceneAnswer::overlap) two.slot = take_slot();
    }
    answer_all(fresh.size(), workspaces.size(), parallel,
               [&](std::size_t i, std::size_t worker) { answer(fresh[i], workspaces[worker]); });
    merge();
    for (const std::uint32_t i : moved) {
      bodies[i].moved = false;
      if (bodies[i].place == Place::free) free_bodies.push_back(i);
    }
    moved.clear();
    out.pairs = pairs;
    out.ended = ended;
    return out;
  }

  /// Of those of before that stay and those that were asked: all, the pairs that meet, and those
  /// that no longer do.
  void merge() noexcept {
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
        if (is_kept(*old))
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

  SceneSettings settings;
  std::array<SceneRule, kSceneGroups * kSceneGroups> rules;
  double margin = 0;       ///< half the largest of the rules': each body has one
  bool by_spheres = true;  ///< a rule asks a measure of spheres, which stick out
  BoxTree still, moving;
  std::vector<Body> bodies;
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  std::vector<std::uint32_t> free_bodies, moved, endless, refused_bodies, refused;
  std::vector<std::uint64_t> excluded;
  bool (*filter)(const void*, std::uint32_t, std::uint32_t) noexcept = nullptr;
  const void* context = nullptr;
  std::vector<Candidate> now, before, fresh;
  std::size_t kept = 0;
  std::vector<ScenePair> pairs;
  std::vector<Penetration> penetrations;  ///< by slot, as `separations` and `patches`
  std::vector<Separation> separations;
  std::vector<ContactPatch> patches;
  std::vector<std::uint32_t> free_slots;
  std::vector<ScenePairName> ended;
  bool exceeded = false;
  std::vector<Workspace> workspaces;
};

Scene::Scene(const SceneSettings& settings) {
  const auto in_range = [](std::size_t value, std::size_t most, const char* name) {
    if (value < 1 || value > most)
      throw Error("a scene's " + std::string(name) + " is " + std::to_string(value) +
                  ": give 1 to " + std::to_string(most));
  };
  in_range(settings.max_bodies, 1u << 30, "max_bodies");
  in_range(settings.max_pairs, 1u << 30, "max_pairs");
  in_range(settings.patches_per_pair, 1024, "patches_per_pair");
  in_range(settings.workers, 4096, "workers");
  impl_ = std::make_unique<Impl>(settings);
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

void Scene::add(const SceneBody& body) {
  Impl& all = *impl_;
  const std::string name = "body " + std::to_string(body.number);
  if (all.find(body.number) != nullptr) throw Error(name + " is in the scene already");
  if (body.group >= kSceneGroups)
    throw Error(name + ": group " + std::to_string(body.group) + " is not below " +
                std::to_string(kSceneGroups));
  if (all.index_of.size() == all.settings.max_bodies)
    throw Error(name + ": the scene is full; give a larger SceneSettings::max_bodies (" +
                std::to_string(all.settings.max_bodies) + ")");
  std::uint32_t at = 0;
  if (!all.free_bodies.empty()) {
    at = all.free_bodies.back();
    all.free_bodies.pop_back();
  } else {
    // Those of bodies that were removed since the last step are not free yet.
    at = static_cast<std::uint32_t>(all.bodies.size());
    all.bodies.emplace_back();
    all.take_room(all.bodies.size());
  }
  all.index_of.emplace(body.number, at);
  all.bodies[at] = {};
  all.bodies[at].given = body;
  all.bodies[at].kept = BodyBox(body.solid);
  all.place(all.bodies[at], false);
}

bool Scene::remove(std::uint32_t number) noexcept {
  auto* const body = impl_->find(number);
  if (body == nullptr) return false;
  impl_->index_of.erase(number);
  impl_->take_out(*body);
  impl_->note_moved(*body);
  return true;
}

bool Scene::set_pose(std::uint32_t number, const Pose& pose) noexcept {
  return set_poses({&number, 1}, {&pose, 1}) == 1;
}

std::size_t Scene::set_poses(std::span<const std::uint32_t> numbers,
                             std::span<const Pose> poses) noexcept {
  Impl& all = *impl_;
  const std::size_t count = std::min(numbers.size(), poses.size());
  const bool at_once = 8 * count > all.index_of.size();
  std::size_t set = 0;
  for (std::size_t i = 0; i < count; ++i) {
    auto* const body = all.find(numbers[i]);
    if (body == nullptr) continue;
    std::visit([&](auto& placed) { placed.pose = poses[i]; }, body->given.solid.placed);
    all.place(*body, at_once);
    ++set;
  }
  if (at_once) {
    all.still.refit();
    all.moving.refit();
  }
  return set;
}

std::size_t Scene::size() const noexcept { return impl_->index_of.size(); }

std::optional<SceneBody> Scene::body(std::uint32_t number) const {
  auto* const body = impl_->find(number);
  return body == nullptr ? std::nullopt : std::optional(body->given);
}

void Scene::set_rule(std::uint32_t group_a, std::uint32_t group_b, const SceneRule& rule) {
  if (group_a >= kSceneGroups || group_b >= kSceneGroups)
    throw Error("a rule's groups are " + std::to_string(group_a) + " and " +
                std::to_string(group_b) + ": give numbers below " + std::to_string(kSceneGroups));
  if (!(rule.margin >= 0 && std::isfinite(rule.margin)))
    throw Error("a rule's margin is " + std::to_string(rule.margin) + ": give 0 or more");
  Impl& all = *impl_;
  SceneRule plain = rule;
  plain.penetration.pair_id = 0;
  if (rule.answer == SceneAnswer::patches && all.patches.empty())
    all.patches.resize(all.settings.max_pairs * all.settings.patches_per_pair);
  all.rules[group_a * kSceneGroups + group_b] = all.rules[group_b * kSceneGroups + group_a] = plain;
  all.margin = 0;
  all.by_spheres = false;
  for (const SceneRule& one : all.rules) {
    all.margin = std::max(all.margin, one.margin / 2);
    all.by_spheres |=
        one.answer > SceneAnswer::overlap && one.penetration.measure == Measure::matched;
  }
  all.place_all();
}

void Scene::exclude(std::uint32_t a, std::uint32_t b) {
  auto& list = impl_->excluded;
  const auto at = std::lower_bound(list.begin(), list.end(), key_of(a, b));
  if (at != list.end() && *at == key_of(a, b)) return;
  list.insert(at, key_of(a, b));
  for (const std::uint32_t number : {a, b})
    if (auto* const body = impl_->find(number)) impl_->note_moved(*body);
}

void Scene::include(std::uint32_t a, std::uint32_t b) noexcept {
  auto& list = impl_->excluded;
  const auto at = std::lower_bound(list.begin(), list.end(), key_of(a, b));
  if (at == list.end() || *at != key_of(a, b)) return;
  list.erase(at);
  for (const std::uint32_t number : {a, b})
    if (auto* const body = impl_->find(number)) impl_->note_moved(*body);
}

void Scene::set_filter(bool (*filter)(const void*, std::uint32_t, std::uint32_t) noexcept,
                       const void* context) noexcept {
  impl_->filter = filter;
  impl_->context = context;
  impl_->place_all();
}

SceneStep Scene::step(const ParallelFor& parallel) noexcept { return impl_->step(parallel); }

Penetration Scene::penetration(const ScenePair& pair) const noexcept {
  return pair.slot < impl_->penetrations.size() ? impl_->penetrations[pair.slot] : Penetration{};
}
Separation Scene::separation(const ScenePair& pair) const noexcept {
  return pair.slot < impl_->separations.size() ? impl_->separations[pair.slot] : Separation{};
}
std::span<const ContactPatch> Scene::patches(const ScenePair& pair) const noexcept {
  const std::size_t first = std::size_t{pair.slot} * impl_->settings.patches_per_pair;
  if (pair.patch_count == 0 || first + pair.patch_count > impl_->patches.size()) return {};
  return {impl_->patches.data() + first, pair.patch_count};
}

SceneHit Scene::raycast(const Ray& ray) const noexcept {
  SceneHit best;
  // (also for a ray that is not usable)
  if (!ray.origin.allFinite() || !ray.direction.allFinite() || ray.direction.isZero(0)) return best;
  const Eigen::Vector3d unit = ray.direction.stableNormalized();
  double longest = ray.longest;
  const auto enter = [&](const SceneBox& box) {
    double from = 0, to = longest;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double low = box.low[i] - ray.origin[k], high = box.high[i] - ray.origin[k];
      if (unit[k] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      const double x = low / unit[k], y = high / unit[k];
      from = std::max(from, std::min(x, y));
      to = std::min(to, std::max(x, y));
    }
    // Rounding must not pass a flat box.
    return from <= to * (1 + 1e-12) + 1e-300;
  };
  const auto visit = [&](std::uint32_t i) {
    const auto& body = impl_->bodies[i];
    const RayHit hit = ist::raycast(body.given.solid, ray);
    if (hit.status != QueryStatus::ok || !hit.hit() || !(hit.distance <= longest)) return;
    if (best.hit.hit() && hit.distance == best.hit.distance && body.given.number > best.number)
      return;
    best = {body.given.number, hit};
    longest = hit.distance;
  };
  for (const std::uint32_t i : impl_->endless) visit(i);
  impl_->still.each(enter, visit);
  impl_->moving.each(enter, visit);
  return best;
}

std::size_t Scene::in_box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                          std::span<std::uint32_t> numbers) const noexcept {
  const SceneBox box = box_around(lower, upper);
  std::size_t count = 0;
  const auto visit = [&](std::uint32_t i) {
    if (count < numbers.size()) numbers[count] = impl_->bodies[i].given.number;
    ++count;
  };
  const auto enter = [&](const SceneBox& node) { return node.meets(box); };
  for (const std::uint32_t i : impl_->endless) visit(i);
  impl_->still.each(enter, visit);
  impl_->moving.each(enter, visit);
  return count;
}

}  // namespace ist
