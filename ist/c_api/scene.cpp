#include <ist/c_scene.h>
#include <ist/scene.h>
#include <algorithm>
#include <new>

#include "c_api/structs.h"

namespace ist::c_api {
namespace {

struct OwnedScene {
  explicit OwnedScene(const SceneSettings& settings) : scene(settings) {}

  Scene scene;
  int32_t (*filter)(const void* context, std::uint32_t a, std::uint32_t b) = nullptr;
  const void* context = nullptr;
};

/// A scene's handle. The mark identifies invalid handles without following the pointer.
struct SceneHandle {
  std::uint64_t mark;
  OwnedScene* owned;

  static constexpr std::uint64_t kMark = 0x7473692d6e656373;  // "scen-ist"
  bool made() const noexcept { return mark == (kMark ^ reinterpret_cast<std::uintptr_t>(owned)); }
};
static_assert(sizeof(SceneHandle) <= sizeof(ist_scene_t));

/// Calls use(scene) for a valid handle and returns the status.
template <class Handle, class Use>
ist_status_t with_scene(Handle* handle, const Use& use) noexcept {
  if (handle == nullptr) return IST_NULL_POINTER;
  const auto& scene = *reinterpret_cast<const SceneHandle*>(handle);
  if (!scene.made()) return IST_NO_HANDLE;
  try {
    return use(*scene.owned);
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  } catch (const Error&) {
    return IST_INVALID_INPUT;
  }
}

Motion motion(const ist_motion_t& given) noexcept {
  return {vector(given.velocity), vector(given.angular_velocity), vector(given.about)};
}

ist_status_t read(const ist_scene_rule_t* given, SceneRule& rule) noexcept {
  if (given == nullptr) return IST_OK;
  ist_status_t status = check_size(given);
  if (status == IST_OK) status = c_api::read(given->penetration, rule.penetration);
  if (status == IST_OK) status = c_api::read(given->impact, rule.impact);
  if (status != IST_OK) return status;
  if (given->answer < IST_SCENE_PENETRATION || given->answer > IST_SCENE_IMPACT)
    return IST_INVALID_INPUT;
  constexpr SceneAnswer kAnswers[] = {SceneAnswer::penetration, SceneAnswer::nothing,
                                      SceneAnswer::boxes,       SceneAnswer::overlap,
                                      SceneAnswer::patches,     SceneAnswer::impact};
  rule.answer = kAnswers[given->answer];
  rule.margin = given->margin;
  return IST_OK;
}

// Pairs and patches are returned as pointers.
static_assert(sizeof(ist_scene_pair_t) == sizeof(ScenePair));
static_assert(offsetof(ist_scene_pair_t, b) == offsetof(ScenePair, b));
static_assert(offsetof(ist_scene_pair_t, stays) == offsetof(ScenePair, event));
static_assert(static_cast<int>(SceneEvent::begins) == 0);
static_assert(offsetof(ist_scene_pair_t, overlapping) == offsetof(ScenePair, overlapping));
static_assert(sizeof(ScenePair::overlapping) == sizeof(ist_yes_no_t));
static_assert(offsetof(ist_scene_pair_t, slot) == offsetof(ScenePair, slot));
static_assert(offsetof(ist_scene_pair_t, patch_count) == offsetof(ScenePair, patch_count));
static_assert(sizeof(ist_scene_pair_name_t) == sizeof(ScenePairName));
static_assert(offsetof(ist_scene_pair_name_t, b) == offsetof(ScenePairName, b));

/// Calls set(scene, numbers, values) with values converted to C++.
template <class Value, class Given, class Set>
ist_status_t set_all(ist_scene_t* scene, const std::uint32_t* numbers, const Given* values,
                     std::size_t count, const Set& set) noexcept {
  static_assert(sizeof(Value) == sizeof(Given));
  return with_scene(scene, [&](OwnedScene& all) -> ist_status_t {
    if (count > 0 && (numbers == nullptr || values == nullptr)) return IST_NULL_POINTER;
    const std::span given(reinterpret_cast<const Value*>(values), count);
    return set(all.scene, std::span(numbers, count), given) == count ? IST_OK : IST_NO_BODY;
  });
}

template <class Answer, class Find>
ist_status_t tell(const ist_scene_t* scene, const ist_scene_pair_t* pair, Answer* answer,
                  const Find& find) noexcept {
  ist_status_t status = clear(answer);
  if (status != IST_OK) return status;
  status = with_scene(scene, [&](const OwnedScene& all) -> ist_status_t {
    if (pair == nullptr) return IST_NULL_POINTER;
    write(find(all.scene, reinterpret_cast<const ScenePair&>(*pair)), *answer);
    return answer->status;
  });
  return answer->status = status;
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_scene_make(const ist_scene_settings_t* settings, ist_scene_t* scene) {
  if (scene == nullptr) return IST_NULL_POINTER;
  *scene = {};
  ist::SceneSettings wanted;
  if (settings != nullptr) {
    if (settings->size != sizeof *settings) return IST_WRONG_SIZE;
    const auto set = [](auto& member, auto given) {
      if (given != 0) member = given;
    };
    set(wanted.max_bodies, settings->max_bodies);
    set(wanted.max_pairs, settings->max_pairs);
    set(wanted.patches_per_pair, settings->patches_per_pair);
    set(wanted.workers, settings->workers);
    set(wanted.workspace_capacity, settings->workspace_capacity);
  }
  try {
    auto* const owned = new OwnedScene(wanted);
    new (scene) SceneHandle{SceneHandle::kMark ^ reinterpret_cast<std::uintptr_t>(owned), owned};
    return IST_OK;
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  } catch (const std::exception&) {
    return IST_INVALID_INPUT;
  }
}

ist_status_t ist_scene_release(ist_scene_t* scene) {
  return with_scene(scene, [&](ist::c_api::OwnedScene& owned) {
    delete &owned;
    *scene = {};
    return IST_OK;
  });
}

ist_status_t ist_scene_add(ist_scene_t* scene, const ist_scene_body_t* given) {
  return with_scene(scene, [&](OwnedScene& all) -> ist_status_t {
    ist_status_t status = check_size(given);
    ist::SceneBody body;
    if (status == IST_OK) status = read(given->solid, body.solid);
    if (status != IST_OK) return status;
    body.number = given->number;
    body.moves = given->is_still == 0;
    body.group = given->group;
    if (given->layers != 0) body.layers = given->layers;
    if (given->meets != 0) body.meets = given->meets;
    if (given->motion != nullptr) body.motion = motion(*given->motion);
    if (all.scene.body(body.number)) return IST_NUMBER_TAKEN;
    if (all.scene.size() == all.scene.settings().max_bodies) return IST_SCENE_FULL;
    all.scene.add(body);
    return IST_OK;
  });
}

ist_status_t ist_scene_remove(ist_scene_t* scene, uint32_t number) {
  return with_scene(
      scene, [&](OwnedScene& all) { return all.scene.remove(number) ? IST_OK : IST_NO_BODY; });
}

ist_status_t ist_scene_set_poses(ist_scene_t* scene, const uint32_t* numbers,
                                 const ist_pose_t* poses, size_t count) {
  static_assert(offsetof(ist_pose_t, t) == offsetof(ist::Pose, t));
  return set_all<ist::Pose>(scene, numbers, poses, count, [](auto& all, auto of, auto values) {
    return all.set_poses(of, values);
  });
}

ist_status_t ist_scene_set_motions(ist_scene_t* scene, const uint32_t* numbers,
                                   const ist_motion_t* motions, size_t count) {
  static_assert(offsetof(ist_motion_t, about) == offsetof(ist::Motion, about));
  return set_all<ist::Motion>(scene, numbers, motions, count, [](auto& all, auto of, auto values) {
    return all.set_motions(of, values);
  });
}

ist_status_t ist_scene_set_rule(ist_scene_t* scene, uint32_t group_a, uint32_t group_b,
                                const ist_scene_rule_t* given) {
  return with_scene(scene, [&](OwnedScene& all) {
    ist::SceneRule rule;
    const ist_status_t status = read(given, rule);
    if (status == IST_OK) all.scene.set_rule(group_a, group_b, rule);
    return status;
  });
}

ist_status_t ist_scene_join(ist_scene_t* scene, uint32_t a, uint32_t b, uint32_t joined) {
  return with_scene(scene, [&](OwnedScene& all) {
    if (joined != 0)
      all.scene.exclude(a, b);
    else
      all.scene.include(a, b);
    return IST_OK;
  });
}

ist_status_t ist_scene_set_filter(ist_scene_t* scene,
                                  int32_t (*filter)(const void*, uint32_t, uint32_t),
                                  const void* context) {
  return with_scene(scene, [&](OwnedScene& all) {
    all.filter = filter;
    all.context = context;
    const auto ask = [](const void* owned, std::uint32_t a, std::uint32_t b) noexcept {
      const auto& own = *static_cast<const OwnedScene*>(owned);
      return own.filter(own.context, a, b) != 0;
    };
    if (filter != nullptr)
      all.scene.set_filter(ask, &all);
    else
      all.scene.set_filter(nullptr, nullptr);
    return IST_OK;
  });
}

ist_status_t ist_scene_take_step(ist_scene_t* scene, const ist_parallel_t* parallel,
                                 ist_scene_step_t* step) {
  ist_status_t status = clear(step);
  if (status != IST_OK) return status;
  status = with_scene(scene, [&](OwnedScene& all) -> ist_status_t {
    const ist_status_t given = parallel == nullptr ? IST_OK : check_size(parallel);
    if (given != IST_OK) return given;
    const ist::SceneStep found = all.scene.step(
        parallel == nullptr ? ist::ParallelFor{} : ist::ParallelFor{parallel->run, parallel->pool});
    step->pairs = reinterpret_cast<const ist_scene_pair_t*>(found.pairs.data());
    step->pair_count = found.pairs.size();
    step->ended = reinterpret_cast<const ist_scene_pair_name_t*>(found.ended.data());
    step->ended_count = found.ended.size();
    step->refused = found.refused.data();
    step->refused_count = found.refused.size();
    step->boxes_met = found.boxes_met;
    return found.pairs_exceeded ? IST_BUDGET_EXHAUSTED : IST_OK;
  });
  return step->status = status;
}

ist_status_t ist_scene_get_penetration(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                       ist_penetration_t* answer) {
  return tell(scene, pair, answer,
              [](const auto& all, const auto& of) { return all.penetration(of); });
}
ist_status_t ist_scene_get_separation(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                      ist_separation_t* answer) {
  return tell(scene, pair, answer,
              [](const auto& all, const auto& of) { return all.separation(of); });
}
ist_status_t ist_scene_get_impact(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                  ist_impact_t* answer) {
  return tell(scene, pair, answer, [](const auto& all, const auto& of) { return all.impact(of); });
}

ist_status_t ist_scene_get_patches(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                   ist_contact_patches_t* patches) {
  ist_status_t status = check_size(patches);
  if (status != IST_OK) return status;
  patches->count = 0;
  if (patches->patch_size != sizeof(ist_contact_patch_t)) return IST_WRONG_SIZE;
  return with_scene(scene, [&](const OwnedScene& all) -> ist_status_t {
    if (pair == nullptr || (patches->patches == nullptr && patches->capacity > 0))
      return IST_NULL_POINTER;
    const auto found = all.scene.patches(reinterpret_cast<const ist::ScenePair&>(*pair));
    patches->count = std::min(found.size(), patches->capacity);
    if (patches->count > 0)
      std::memcpy(patches->patches, found.data(), patches->count * sizeof(ist_contact_patch_t));
    return IST_OK;
  });
}

ist_status_t ist_scene_raycast(const ist_scene_t* scene, const ist_ray_t* rays, size_t count,
                               uint32_t* numbers, ist_ray_hit_t* hits, size_t hit_size) {
  if (hit_size != sizeof(ist_ray_hit_t)) return IST_WRONG_SIZE;
  return with_scene(scene, [&](const OwnedScene& all) -> ist_status_t {
    if (count > 0 && (rays == nullptr || numbers == nullptr || hits == nullptr))
      return IST_NULL_POINTER;
    ist_status_t least = IST_OK;
    for (std::size_t i = 0; i < count; ++i) {
      const ist::SceneHit found = all.scene.raycast(read(rays[i]));
      numbers[i] = found.number;
      write(found.hit, hits[i]);
      least = std::min(least, hits[i].status);
    }
    return least;
  });
}

ist_status_t ist_scene_nearest(const ist_scene_t* scene, const double* points, size_t count,
                               double max_distance, uint32_t* numbers, ist_surface_point_t* answers,
                               size_t answer_size) {
  if (answer_size != sizeof(ist_surface_point_t)) return IST_WRONG_SIZE;
  return with_scene(scene, [&](const OwnedScene& all) -> ist_status_t {
    if (count > 0 && (points == nullptr || numbers == nullptr || answers == nullptr))
      return IST_NULL_POINTER;
    ist_status_t least = IST_OK;
    for (std::size_t i = 0; i < count; ++i) {
      const ist::SceneNearest found =
          all.scene.nearest(Eigen::Vector3d(points + 3 * i), max_distance);
      numbers[i] = found.number;
      write(found.surface, answers[i]);
      least = std::min(least, answers[i].status);
    }
    return least;
  });
}

ist_status_t ist_scene_in_box(const ist_scene_t* scene, const double lower[3],
                              const double upper[3], uint32_t* numbers, size_t capacity,
                              size_t* count) {
  if (count == nullptr) return IST_NULL_POINTER;
  *count = 0;
  return with_scene(scene, [&](const OwnedScene& all) -> ist_status_t {
    if (lower == nullptr || upper == nullptr || (numbers == nullptr && capacity > 0))
      return IST_NULL_POINTER;
    for (int k = 0; k < 3; ++k)
      if (!(lower[k] <= upper[k])) return IST_INVALID_INPUT;
    *count = all.scene.in_box(Eigen::Vector3d(lower), Eigen::Vector3d(upper), {numbers, capacity});
    return IST_OK;
  });
}
