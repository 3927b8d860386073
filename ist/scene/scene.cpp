#include <ist/scene.h>

#include <algorithm>
#include <cmath>

#include "query/base/relative_pose.h"
#include "scene/body_box.h"
#include "scene/scene_impl.h"

namespace ist {

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
  if (all.find(body.number) != kNone) throw Error(name + " is in the scene already");
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
    // Slots of bodies removed since the last step are not free yet.
    at = static_cast<std::uint32_t>(all.bodies.size());
    all.take_room(at + std::size_t{1});
    all.bodies.emplace_back();
    all.blocks.resize(at / kCount + 1);
    all.lanes.resize(all.blocks.size());
    all.number_of.resize(kCount * all.blocks.size());
    all.filtered.resize(all.number_of.size());
  }
  all.index_of.emplace(body.number, at);
  all.bodies[at] = {};
  all.bodies[at].given = body;
  all.bodies[at].kept = BodyBox(body.solid);
  all.number_of[at] = body.number;
  all.filtered[at] = {body.layers, body.meets, static_cast<std::uint8_t>(body.group), body.moves,
                      std::holds_alternative<PlacedShape>(body.solid.placed)};
  all.blocks[at / kCount].set_pose(
      at % kCount, std::visit([](const auto& placed) { return placed.pose; }, body.solid.placed));
  all.prepare(at);
  all.put_waiting(false);
}

bool Scene::remove(std::uint32_t number) noexcept {
  const std::uint32_t at = impl_->find(number);
  if (at == kNone) return false;
  impl_->index_of.erase(number);
  impl_->take_out(at);
  impl_->note_moved(at);
  impl_->removed.push_back(at);
  std::erase_if(impl_->excluded, [&](std::uint64_t key) {
    const ScenePairName two = name_of(key);
    return two.a == number || two.b == number;
  });
  return true;
}

bool Scene::set_pose(std::uint32_t number, const Pose& pose) noexcept {
  return set_poses({&number, 1}, {&pose, 1}) == 1;
}

std::size_t Scene::set_poses(std::span<const std::uint32_t> numbers,
                             std::span<const Pose> poses) noexcept {
  return impl_->set_poses(numbers.first(std::min(numbers.size(), poses.size())), poses.data());
}

std::size_t Scene::set_motions(std::span<const std::uint32_t> numbers,
                               std::span<const Motion> motions) noexcept {
  return impl_->set_motions(numbers.first(std::min(numbers.size(), motions.size())),
                            motions.data());
}

std::size_t Scene::size() const noexcept { return impl_->index_of.size(); }

const SceneSettings& Scene::settings() const noexcept { return impl_->settings; }

std::vector<std::uint32_t> Scene::numbers() const {
  std::vector<std::uint32_t> out;
  for (const auto& [number, at] : impl_->index_of) out.push_back(number);
  std::sort(out.begin(), out.end());
  return out;
}

std::optional<SceneBody> Scene::body(std::uint32_t number) const {
  const std::uint32_t at = impl_->find(number);
  if (at == kNone) return std::nullopt;
  SceneBody out = impl_->bodies[at].given;
  out.solid = impl_->solid_of(at);
  return out;
}

void Scene::set_rule(std::uint32_t group_a, std::uint32_t group_b, const SceneRule& rule) {
  if (group_a >= kSceneGroups || group_b >= kSceneGroups)
    throw Error("a rule's groups are " + std::to_string(group_a) + " and " +
                std::to_string(group_b) + ": give numbers below " + std::to_string(kSceneGroups));
  if (rule.answer > SceneAnswer::impact || rule.penetration.measure > Measure::exact)
    throw Error("a rule's answer is " + std::to_string(static_cast<unsigned>(rule.answer)) +
                " and its measure " +
                std::to_string(static_cast<unsigned>(rule.penetration.measure)) +
                ": give ones that have names");
  if (!(std::isfinite(rule.margin) && rule.margin >= 0))
    throw Error("a rule's margin is " + std::to_string(rule.margin) + ": give 0 or more");
  if (rule.answer == SceneAnswer::impact &&
      !(std::isfinite(rule.impact.duration) && rule.impact.duration > 0))
    throw Error("a rule's duration is " + std::to_string(rule.impact.duration) +
                ": give more than 0");
  Impl& all = *impl_;
  SceneRule plain = rule;
  plain.penetration.pair_id = 0;
  if (rule.answer == SceneAnswer::impact && all.impacts.empty())
    all.impacts.resize(all.settings.max_pairs);
  if (rule.answer == SceneAnswer::patches && all.patches.empty())
    all.patches.resize(all.settings.max_pairs * all.settings.patches_per_pair);
  all.rules[group_a * kSceneGroups + group_b] = all.rules[group_b * kSceneGroups + group_a] = plain;
  all.note_answers();
  all.widths = {};
  for (const SceneRule& one : all.rules) {
    all.widths.margin = std::max(all.widths.margin, one.margin / 2);
    if (one.answer == SceneAnswer::impact) {
      all.widths.duration = std::max(all.widths.duration, one.impact.duration);
      if (std::isfinite(one.impact.tolerance) && one.impact.tolerance > 0)
        all.widths.margin = std::max(all.widths.margin, one.impact.tolerance / 2);
      else
        all.widths.by_size = true;
    } else if (one.answer > SceneAnswer::overlap) {
      all.widths.by_spheres |= one.penetration.measure == Measure::matched;
    }
  }
  all.prepare_all();
}

void Scene::exclude(std::uint32_t a, std::uint32_t b) {
  auto& list = impl_->excluded;
  const auto at = std::lower_bound(list.begin(), list.end(), key_of(a, b));
  if (at != list.end() && *at == key_of(a, b)) return;
  list.insert(at, key_of(a, b));
  for (const std::uint32_t number : {a, b})
    if (const std::uint32_t at = impl_->find(number); at != kNone) impl_->note_moved(at);
}

void Scene::include(std::uint32_t a, std::uint32_t b) noexcept {
  auto& list = impl_->excluded;
  const auto at = std::lower_bound(list.begin(), list.end(), key_of(a, b));
  if (at == list.end() || *at != key_of(a, b)) return;
  list.erase(at);
  for (const std::uint32_t number : {a, b})
    if (const std::uint32_t at = impl_->find(number); at != kNone) impl_->note_moved(at);
}

void Scene::set_filter(bool (*filter)(const void*, std::uint32_t, std::uint32_t) noexcept,
                       const void* context) noexcept {
  impl_->filter = filter;
  impl_->context = context;
  impl_->prepare_all();
}

SceneStep Scene::step(const ParallelFor& parallel) noexcept { return impl_->step(parallel); }

Penetration Scene::penetration(const ScenePair& pair) const noexcept {
  return pair.slot < impl_->penetrations.size() ? impl_->penetrations[pair.slot] : Penetration{};
}
Separation Scene::separation(const ScenePair& pair) const noexcept {
  return pair.slot < impl_->separations.size() ? impl_->separations[pair.slot] : Separation{};
}
TimeOfImpact Scene::impact(const ScenePair& pair) const noexcept {
  return pair.slot < impl_->impacts.size() ? impl_->impacts[pair.slot] : TimeOfImpact{};
}
std::span<const ContactPatch> Scene::patches(const ScenePair& pair) const noexcept {
  const std::size_t first = std::size_t{pair.slot} * impl_->settings.patches_per_pair;
  if (pair.patch_count == 0 || first + pair.patch_count > impl_->patches.size()) return {};
  return {impl_->patches.data() + first, pair.patch_count};
}

BodyBox::BodyBox(const PlacedSolid& solid) noexcept {
  if (const auto* tree = std::get_if<PlacedAsset>(&solid.placed)) {
    box_ = solid_box(tree->asset);
    scale_ = tree->scale;
  } else {
    const auto& field = std::get<PlacedShape>(solid.placed);
    box_ = solid_box(field.shape);
    scale_ = field.scale;
  }
  box_.scale(scale_);
  // As in time_of_impact(): by the smaller solid, or by the errors of both.
  tolerance_ = std::max(1e-3 * vector(box_.half).norm(), 10 * box_.mesh_error);
}

bool BodyBox::sweep(WorldBox& box, double duration, const Motion& motion) const noexcept {
  if (!motion.velocity.allFinite() || !motion.angular_velocity.allFinite() ||
      !motion.about.allFinite())
    return false;
  // A point that rotates about another moves no further than the arc, or twice its distance.
  const Eigen::Vector3d far =
      (vector(box_.middle) - scale_ * motion.about).cwiseAbs() + vector(box_.half);
  const double angle = motion.angular_velocity.norm() * duration;
  const double turned = (1 + 1e-12) * std::min(angle, 2.0) * far.norm();
  const Eigen::Vector3d way = motion.velocity * duration;
  for (int k = 0; k < 3; ++k) {
    box.low[k] += std::min(way[k], 0.0) - turned;
    box.high[k] += std::max(way[k], 0.0) + turned;
  }
  return true;
}

}  // namespace ist
